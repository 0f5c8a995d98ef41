#pragma once

#include <optional>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "levelset/fields/field.h"
#include "levelset/fields/mask.h"

/// Reads parameters whose value is a field: a formula in x, y and z, or a value of the chain
/// (@NAME).
namespace pipeline {

/// Returns the field of a parameter of type Scalar. A level set stands for its signed distance.
/// @throws levelset::UsageError, InvalidInput for a field of vectors
[[nodiscard]] levelset::ScalarField scalarField(const Invocation& in, const std::string& param);

/// Returns the field of a parameter of type Velocity that is given by formulas or as @NAME, not by
/// the name of a built-in velocity.
/// @throws levelset::UsageError, InvalidInput for a field of numbers
[[nodiscard]] levelset::VectorField vectorField(const Invocation& in, const std::string& param);

/// Returns the speed of a parameter of type Speed. A level set stands for its signed distance.
/// @throws levelset::UsageError, InvalidInput for a field of vectors
[[nodiscard]] levelset::NormalSpeed normalSpeed(const Invocation& in, const std::string& param);

/// Returns the attribute of a surface that a parameter of type Scalar describes. A scalar attribute
/// throws levelset::InvalidInput where it is not finite.
[[nodiscard]] levelset::Attribute attribute(const Invocation& in, const std::string& param);

/// Parameters of a mask: --mask, --mask-min, --mask-max and --mask-invert.
[[nodiscard]] std::vector<Param> maskParams();
/// Appends the parameters of a mask to `params`.
[[nodiscard]] std::vector<Param> withMask(std::vector<Param> params);
/// Returns the mask that the options of maskParams() describe; empty without --mask.
/// @throws levelset::UsageError for limits in the wrong order, or limits without a mask
[[nodiscard]] std::optional<levelset::Mask> maskOf(const Invocation& in);

}  // namespace pipeline
