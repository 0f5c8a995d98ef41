#pragma once

#include <Imath/ImathVec.h>

#include <span>
#include <utility>
#include <vector>

#include "levelset/shapes/shapes.h"
#include "mapping/animation/animation.h"
#include "mapping/placement/make_patch.h"

/// Small animated scenes.
namespace support {

inline constexpr double kStageVoxel = 0.1;

inline const mapping::PatchOptions& thinPatch() {
  static const mapping::PatchOptions options = {
      .layers = 2, .scheme = mapping::LayerScheme::Conforming, .spacing = 0.3};
  return options;
}

inline levelset::NarrowBand ballAt(const Imath::V3d& centre, double radius = 1,
                                   double voxel = kStageVoxel) {
  return levelset::makeSphere(radius, centre, voxel);
}

inline mapping::Patch patchAt(const levelset::NarrowBand& base, const Imath::V3d& at,
                              double size = 0.6, double rotation = 0, double height = 0.3) {
  return mapping::makePatch(base, mapping::cornersAround(base, at, size, size, rotation), height,
                            thinPatch())
      .patch;
}

inline mapping::AnimationKey keyOf(const mapping::Patch& patch, std::size_t frame = 0) {
  return {{patch}, {mapping::outlineOf(patch)}, frame};
}

inline std::vector<mapping::Patch> remakePatches(const levelset::NarrowBand& base,
                                                 std::span<const mapping::Footprint> footprints,
                                                 std::span<const mapping::Footprint>,
                                                 const levelset::Progress&) {
  std::vector<mapping::Patch> patches;
  for (const mapping::Footprint& f : footprints)
    patches.push_back(mapping::makePatch(base, f.corners, f.height, thinPatch()).patch);
  return patches;
}

/// Plays an animation and keeps the patches of all frames.
struct Played {
  mapping::AnimationReport report;
  std::vector<mapping::Patch> patches;
};
inline Played play(const levelset::NarrowBand& base, const std::vector<mapping::AnimationKey>& keys,
                   mapping::AnimationOptions options) {
  Played played;
  if (!options.make) options.make = remakePatches;
  played.report = mapping::animatePatches(base, keys, options, [&](const mapping::PatchFrame& f) {
    played.patches.push_back(f.patches.at(0));
  });
  return played;
}

}  // namespace support
