#pragma once

// For the .cpp files of levelset/csg only.

#include "levelset/csg/blend.h"
#include "levelset/geometry/search/point_search.h"
#include "levelset/vdb.h"

namespace levelset::solids {

struct SeamRequest {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Two operands on one grid.
struct SeamOperands {
  NarrowBand a, b;
  std::vector<std::string> notes;  ///< one note if an operand was resampled, else empty
};

/// Resamples the solid with the larger voxels to the grid of the other one, unless both have the
/// same transform.
[[nodiscard]] SeamOperands onOneGrid(const NarrowBand& a, const NarrowBand& b,
                                     const SeamRequest& request);

/// Returns a copy of the blocks of a solid within `radius` plus a margin of the seam curve, with
/// values in voxels. The blocks next to them, and inside tiles, have correct signs but no
/// distances.
/// @param radius  voxels
[[nodiscard]] openvdb::FloatGrid::Ptr cutOut(const openvdb::FloatGrid& solid,
                                             const PointSearch& curve, double radius);

}  // namespace levelset::solids
