#pragma once

#include "levelset/vdb.h"

namespace regress::peer {

/// Turns a result of OpenVDB into a band. Active tiles become voxels, inactive values ± background.
[[nodiscard]] inline levelset::NarrowBand adopt(const openvdb::FloatGrid::Ptr& grid) {
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return levelset::importBand(grid);
}

}  // namespace regress::peer
