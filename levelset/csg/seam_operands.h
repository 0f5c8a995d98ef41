#pragma once

// For the .cpp files of levelset/csg only.

#include "levelset/csg/blend.h"
#include "levelset/geometry/point_tree.h"
#include "levelset/vdb.h"

namespace levelset::solids {

struct SeamRequest {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct SeamOperands {
  NarrowBand a, b;
  std::vector<std::string> notes;
};

/// Resamples both solids to the finer grid of the two.
[[nodiscard]] SeamOperands onOneGrid(const NarrowBand& a, const NarrowBand& b,
                                     const SeamRequest& request);

/// Copies the blocks of a solid within `radius` plus a margin of the curve, with values in voxels.
/// Neighbour blocks and tiles deep inside contain only signs.
/// @param radius  voxels
[[nodiscard]] openvdb::FloatGrid::Ptr cutOut(const openvdb::FloatGrid& solid,
                                             const eikonal::PointTree& curve, double radius);

}  // namespace levelset::solids
