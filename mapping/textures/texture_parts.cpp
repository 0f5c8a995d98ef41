#include "mapping/textures/texture_parts.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/csg/clip.h"
#include "levelset/error.h"

namespace mapping {

using Imath::Box3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::UsageError;

void requireTextureArguments(const NarrowBand& base, const NarrowBand& texture,
                             std::span<const Patch> patches, const TextureOptions& options) {
  const auto requirePositive = [](double value, const char* name) {
    if (!(value > 0) || !std::isfinite(value)) {
      throw UsageError(fmt::format("the {} is {}; give a positive number", name, value));
    }
  };
  if (options.voxelSize) requirePositive(*options.voxelSize, "voxel size");
  if (!(options.halfWidth >= 1) || !std::isfinite(options.halfWidth)) {
    throw UsageError(fmt::format("the half width is {}; give at least 1 voxel", options.halfWidth));
  }
  if (!(options.mapTolerance >= 0) || !std::isfinite(options.mapTolerance)) {
    throw UsageError(fmt::format("the map's tolerance is {} texture voxels; give at least 0",
                                 options.mapTolerance));
  }
  if (options.embedDepth && !std::isfinite(*options.embedDepth)) {
    throw UsageError(
        fmt::format("the embedding depth is {}; give a length with --embed", *options.embedDepth));
  }
  const double diagonal = base.zeroSetBounds().size().length();
  if (options.embedDepth && std::abs(*options.embedDepth) > diagonal) {
    throw InvalidInput(
        fmt::format("the embedding depth of {:.6g} exceeds the diagonal of the base, {:.6g}; "
                    "give a smaller --embed",
                    *options.embedDepth, diagonal));
  }
  if (!(options.blend >= 0) || !std::isfinite(options.blend)) {
    throw UsageError(
        fmt::format("the blend radius is {}; give a length of at least 0", options.blend));
  }
  if (options.merge != TextureMerge::Alone && base.isOpenSurface()) {
    throw InvalidInput(
        "the base is an open surface, which has no inside; give --alone for the "
        "texture alone, or map a mesh with --map mesh");
  }
  requireSolid(texture);
  if (base.isEmpty() || texture.isEmpty()) {
    throw InvalidInput(fmt::format("the {} has no surface; give a solid with at least one voxel",
                                   base.isEmpty() ? "base" : "texture"));
  }
  if (patches.empty()) throw UsageError("there is no patch; build one with `patch`");
  for (const Patch& patch : patches) {
    if (patch.layers.size() < 2 || !(patch.height > 0)) {
      throw InvalidInput("the patch has no layers of particles; build it with `patch`");
    }
    requirePatchOn(base, patch);
  }
}

TextureParts::TextureParts(const NarrowBand& texture, const Box3d& box,
                           std::span<const Patch> patches, double voxelSize, bool isCut,
                           const std::function<NarrowBand(const NarrowBand&)>& fit) {
  if (!isCut) {
    parts_.emplace(SharedSides{}, fit(texture));
    ofPatch_.resize(patches.size(), SharedSides{});
    return;
  }
  ofPatch_ = sharedSides(patches);
  double u = HUGE_VAL, v = HUGE_VAL;
  for (const Patch& patch : patches) {
    const ParticleLayer& layer = patch.layers.front();
    u = std::min(u, patch.spacing * static_cast<double>(layer.columns - 1));
    v = std::min(v, patch.spacing * static_cast<double>(layer.rows - 1));
  }
  const double alongU = kBeyond * voxelSize / u * box.size().x,
               alongV = kBeyond * voxelSize / v * box.size().y;
  for (const SharedSides& sides : ofPatch_) {
    if (parts_.contains(sides)) continue;
    Box3d wider = box;
    if (sides[0]) wider.min.x -= alongU;
    if (sides[1]) wider.max.x += alongU;
    if (sides[2]) wider.min.y -= alongV;
    if (sides[3]) wider.max.y += alongV;
    parts_.emplace(sides, fit(levelset::clip(texture, wider)));
  }
}

}  // namespace mapping
