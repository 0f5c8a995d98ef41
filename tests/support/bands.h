#pragma once

// Bands from formulas, for tests.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "levelset/vdb.h"

namespace support {

/// Samples a signed distance (world units) on the axis-aligned grid of `voxelSize` inside `box`.
inline levelset::NarrowBand sampleBand(const std::function<double(const Imath::V3d&)>& phi,
                                       const Imath::Box3d& box, double voxelSize,
                                       double halfWidth = 3) {
  const auto grid = levelset::emptyLevelSet(levelset::uniformTransform(voxelSize), halfWidth);
  const double background = halfWidth * voxelSize;
  auto accessor = grid->getAccessor();
  const auto cell = [&](double x) { return static_cast<int>(std::floor(x / voxelSize)); };
  const int pad = static_cast<int>(halfWidth) + 2;
  openvdb::Coord c;
  for (c[0] = cell(box.min.x) - pad; c[0] <= cell(box.max.x) + pad; ++c[0])
    for (c[1] = cell(box.min.y) - pad; c[1] <= cell(box.max.y) + pad; ++c[1])
      for (c[2] = cell(box.min.z) - pad; c[2] <= cell(box.max.z) + pad; ++c[2]) {
        const double value = phi(levelset::toImath(grid->indexToWorld(c)));
        if (std::abs(value) < background)
          accessor.setValueOn(c, static_cast<float>(value));
        else if (value < 0)
          accessor.setValueOff(c, static_cast<float>(-background));
      }
  grid->pruneGrid();
  return levelset::makeBand(grid);
}

/// Calls visit(world position, φ) at every active voxel, in tree order.
inline void forEachActive(const levelset::NarrowBand& band,
                          const std::function<void(const Imath::V3d&, double)>& visit) {
  const openvdb::FloatGrid& grid = levelset::vdb(band);
  for (auto it = grid.cbeginValueOn(); it; ++it)
    visit(levelset::toImath(grid.indexToWorld(it.getCoord())), static_cast<double>(*it));
}

}  // namespace support
