#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "levelset/fields/field.h"
#include "levelset/narrow_band.h"
#include "mapping/placement/make_patch.h"
#include "mapping/surface/scattered_points.h"

/// Many patches strewn over a surface [Brodersen07 §8.5, figure 8.11].
namespace mapping {

struct ScatterOptions {
  ScatterDensity density = {};  ///< its scale is that of the patches, heights included
  double uSize = 0, vSize = 0;  ///< of a patch at scale 1, world units
  /// u runs along this, as far as the surface lets it; empty or zero: as `cornersAround` has it.
  levelset::VectorField direction = {};
  double rotation = 0;      ///< of u about the normal, radians
  double jitter = 0;        ///< a random turn of up to this to either side, radians
  PatchOptions patch = {};  ///< spacing at scale 1
  bool allowFolds = false;
};

/// Where one patch of many lies.
struct PatchSite {
  std::array<Imath::V3d, 4> corners;
  double scale = 1;
};

struct ScatterResult {
  std::vector<Patch> patches;
  std::vector<PatchSite> sites;  ///< of the patches
  double distance = 0;           ///< least distance of two patches' centres, in their scales
  std::size_t leftOut = 0;       ///< places that bear no patch
  std::string cause;             ///< why the first of them does not
};

/// Strews patches over a surface. A place that bears none, because the surface is too bent or
/// breaks off there or because the patch would fold, is left out and counted; with a count, others
/// are tried instead.
/// @param height  at scale 1, world units
/// @throws as scatterPoints and makePatch do; InvalidInput, telling a cause, when no place bears a
///         patch
[[nodiscard]] ScatterResult scatter(const levelset::NarrowBand& base, double height,
                                    const ScatterOptions& options);

/// The patches of known sites at another height.
[[nodiscard]] std::vector<Patch> makePatches(const levelset::NarrowBand& base,
                                             const std::vector<PatchSite>& sites, double height,
                                             const PatchOptions& options = {});

}  // namespace mapping
