#pragma once

#include <vector>

#include "apps/pipeline/invocation.h"
#include "mapping/patches/patch.h"

/// What all actions that make patches have in common: height and levels of particles.
namespace pipeline {

/// `params` and --height, --levels, --particles, --twist, --taper, --bend, --spacing.
[[nodiscard]] std::vector<Param> withLevels(std::vector<Param> params);
/// @throws levelset::UsageError for options that exclude each other or are out of range
void validateLevels(const Invocation& in);
[[nodiscard]] mapping::PatchOptions patchOptionsOf(Invocation& in);
/// Notes the action and those of its options that other patches can be compared by.
void tellOrigin(const Invocation& in, PatchRecipe& recipe);

}  // namespace pipeline
