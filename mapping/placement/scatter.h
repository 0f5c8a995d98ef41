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

/// Scatters many patches over a surface [Brodersen07 §8.5, figure 8.11].
namespace mapping {

struct ScatterOptions {
  /// Density of positions; its scale also scales the patches, heights included.
  ScatterDensity density = {};
  double uSize = 0, vSize = 0;  ///< size of a patch at scale 1, world units
  /// Direction of u, projected onto the surface; empty or zero: the direction eastOf the normal.
  levelset::VectorField direction = {};
  double rotation = 0;      ///< rotation of u about the normal, radians
  double jitter = 0;        ///< amplitude of a random rotation to either side, radians
  PatchOptions patch = {};  ///< options of each patch; its particle spacing is the one at scale 1
  bool allowFolds = false;
};

/// Corners and scale of one scattered patch.
struct PatchSite {
  std::array<Imath::V3d, 4> corners;
  double scale = 1;
};

struct ScatterResult {
  std::vector<Patch> patches;
  std::vector<PatchSite> sites;  ///< one for each patch
  /// Least distance between two patch centres, divided by their mean scale, world units; infinite
  /// for one patch.
  double distance = 0;
  std::size_t leftOut = 0;  ///< number of positions where no patch could be built
  std::string cause;        ///< reason for the first position left out
};

/// Scatters patches over a surface. A position is left out and counted if the surface bends too
/// much or breaks off there, or if the patch would fold. If a count is given, spare positions are
/// tried instead.
/// @param height  patch height at scale 1, world units
/// @throws UsageError, ResourceLimit as scatterPoints and makePatch
/// @throws InvalidInput as scatterPoints, and with the reason if no position allows a patch
[[nodiscard]] ScatterResult scatter(const levelset::NarrowBand& base, double height,
                                    const ScatterOptions& options);

/// Builds patches at the sites of an earlier scatter() with another height, which is multiplied by
/// the scale of each site.
[[nodiscard]] std::vector<Patch> makePatches(const levelset::NarrowBand& base,
                                             const std::vector<PatchSite>& sites, double height,
                                             const PatchOptions& options = {});

}  // namespace mapping
