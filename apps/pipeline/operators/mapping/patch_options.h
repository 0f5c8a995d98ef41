#pragma once

#include <array>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "mapping/animation/footprint.h"
#include "mapping/patches/patch.h"

/// What all actions that make patches have in common: height and layers of particles.
namespace pipeline {

/// `params` and --height, --levels, --particles, --twist, --taper, --bend, --spacing.
[[nodiscard]] std::vector<Param> withLayers(std::vector<Param> params);
/// @throws levelset::UsageError for options that exclude each other or are out of range
void validateLayers(const Invocation& in);
[[nodiscard]] mapping::PatchOptions patchOptionsOf(Invocation& in);
/// Of --size: along u, along v, world units. @throws levelset::InvalidInput for far too large ones
[[nodiscard]] std::array<double, 2> patchSizeOf(Invocation& in);
[[nodiscard]] std::vector<mapping::PatchOutline> outlinesOf(
    const std::vector<mapping::Patch>& patches);
/// Notes the action and those of its options that other patches can be compared by.
void tellOrigin(const Invocation& in, PatchRecipe& recipe);

}  // namespace pipeline
