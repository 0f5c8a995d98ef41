#pragma once

// Volumes of formulas, and errors of bands made from them.

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "levelset/vdb.h"
#include "levelset/volumes/volume.h"

namespace support {

/// Samples a function of the world position at all grid points.
inline levelset::Volume sampled(const levelset::VolumeGrid& grid,
                                const std::function<double(const Imath::V3d&)>& function) {
  std::vector<float> values;
  for (int k = 0; k < grid.size.z; ++k)
    for (int j = 0; j < grid.size.y; ++j)
      for (int i = 0; i < grid.size.x; ++i)
        values.push_back(static_cast<float>(function(Imath::V3d(i, j, k) * grid.indexToWorld)));
  return {grid, std::move(values)};
}

/// Grid of about n cells along each side of the cube [−1.3, 1.3]³, with spacings in a ratio.
inline levelset::VolumeGrid cubeGrid(int n, const Imath::V3d& ratio = Imath::V3d(1)) {
  levelset::VolumeGrid grid;
  for (int axis = 0; axis < 3; ++axis) {
    grid.size[axis] = static_cast<int>(n / ratio[axis]) + 1;
    grid.indexToWorld[axis][axis] = 2.6 / (grid.size[axis] - 1);
    grid.indexToWorld[3][axis] = -1.3;
  }
  return grid;
}

struct BandError {
  double inside = 0, outside = 0;  ///< largest error on each side, world units
  std::size_t wrongSigns = 0;      ///< grid points further than the error from the surface

  [[nodiscard]] double largest() const { return std::max(inside, outside); }
};

/// Errors of a band against the exact distance. @param phi  negative inside, world units
inline BandError errorOf(const levelset::NarrowBand& band,
                         const std::function<double(const Imath::V3d&)>& phi) {
  BandError error;
  const auto& grid = levelset::vdb(band);
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    const double exact = phi(levelset::toImath(grid.transform().indexToWorld(it.getCoord())));
    const double off = std::abs(static_cast<double>(*it) - exact);
    double& side = exact < 0 ? error.inside : error.outside;
    side = std::max(side, off);
    error.wrongSigns += std::abs(exact) > off && (*it < 0) != (exact < 0);
  }
  return error;
}

}  // namespace support
