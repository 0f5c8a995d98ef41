#pragma once

#include <array>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "mapping/animation/footprint.h"
#include "mapping/patches/patch.h"

/// Parameters of the layers above the surface, which all actions that build patches share.
namespace pipeline {

/// Appends --height, --layers, --particles, --twist, --taper, --bend and --spacing to
/// `params`.
[[nodiscard]] std::vector<Param> withLayers(std::vector<Param> params);
/// @throws levelset::UsageError for options that exclude each other or are out of range
void validateLayers(const Invocation& in);
[[nodiscard]] mapping::PatchOptions patchOptionsOf(Invocation& in);
/// Reads --size: lengths along u and along v, world units.
/// @throws levelset::InvalidInput for a length over ten times the diagonal of the base
[[nodiscard]] std::array<double, 2> patchSizeOf(Invocation& in);
/// Reads --count "n,m", two positive integers: tiles along u and along v.
[[nodiscard]] std::array<std::size_t, 2> countOf(const Invocation& in);
[[nodiscard]] std::vector<mapping::PatchOutline> outlinesOf(
    const std::vector<mapping::Patch>& patches);
/// Stores in the recipe the action and the options that the key patches of `animate` must share.
void tellOrigin(const Invocation& in, PatchRecipe& recipe);

}  // namespace pipeline
