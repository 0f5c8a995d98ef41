#pragma once

// Private to the judge: the field of a volume as a tree, value by value.

#include "levelset/vdb.h"
#include "render/volumes/volume_surface.h"

namespace render {

/// Builds a tree with all samples of the field, and those up to two grid points beyond the border.
/// It visits every grid point, and reads neither the ranges of blocks nor the copies of blocks that
/// the kernel uses.
[[nodiscard]] openvdb::FloatTree::Ptr treeOf(const VolumeSurface& surface);

}  // namespace render
