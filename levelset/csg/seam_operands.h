#pragma once

// For the .cpp files of levelset/solids only.

#include "levelset/csg/blend.h"
#include "levelset/geometry/point_tree.h"
#include "levelset/vdb.h"

namespace levelset::solids {

struct SeamOperands {
  NarrowBand a, b;
  std::vector<std::string> notes;
};

/// Both solids of a blend on the grid points of the finer; takes the first fifth of the progress.
[[nodiscard]] SeamOperands onOneGrid(const NarrowBand& a, const NarrowBand& b,
                                     const BlendOptions& options);

/// The blocks of a solid that come within `radius` (voxels) and a margin of the curve, its values
/// in voxels, and the signs of the blocks around those and of all that is deep inside.
[[nodiscard]] openvdb::FloatGrid::Ptr cutOut(const openvdb::FloatGrid& solid,
                                             const eikonal::PointTree& curve, double radius);

}  // namespace levelset::solids
