#pragma once

#include <optional>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "levelset/fields/field.h"
#include "levelset/fields/mask.h"

/// Parameters that are fields: a formula, or a value of the chain.
namespace pipeline {

/// A parameter of type Scalar. A level set counts as its signed distance.
/// @throws levelset::UsageError, InvalidInput for a field of vectors
[[nodiscard]] levelset::ScalarField scalarField(const Invocation& in, const std::string& param);

/// A parameter of type Velocity whose text is none of its choices.
/// @throws levelset::UsageError, InvalidInput for a field of numbers
[[nodiscard]] levelset::VectorField vectorField(const Invocation& in, const std::string& param);

/// A parameter of type Scalar that is an attribute of a surface: numbers, or vectors.
/// The numbers throw levelset::InvalidInput where they are not finite.
[[nodiscard]] levelset::Attribute attribute(const Invocation& in, const std::string& param);

/// --mask, --mask-min, --mask-max and --mask-invert: to be added to an operator's parameters.
[[nodiscard]] std::vector<Param> maskParams();
/// `params` and those of a mask.
[[nodiscard]] std::vector<Param> withMask(std::vector<Param> params);
/// What they say; empty without --mask.
/// @throws levelset::UsageError for limits in the wrong order, or limits without a mask
[[nodiscard]] std::optional<levelset::Mask> maskOf(const Invocation& in);

}  // namespace pipeline
