#pragma once

#include "levelset/vdb.h"

namespace regress::peer {

/// A result of OpenVDB as a band: active tiles as voxels, inactive values ± background.
[[nodiscard]] inline levelset::NarrowBand adopt(const openvdb::FloatGrid::Ptr& grid) {
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return levelset::importBand(grid, "OpenVDB");
}

}  // namespace regress::peer
