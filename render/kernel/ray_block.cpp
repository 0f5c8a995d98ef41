#include "render/kernel/ray_block.h"

#include <cmath>
#include <limits>

namespace render {

SurfaceShape ShapeBlock::at(std::size_t i) const {
  const auto get = [&](std::size_t p) { return static_cast<double>(part[p][i]); };
  SurfaceShape shape;
  shape.gradient = {get(0), get(1), get(2)};
  shape.trilinearGradient = {get(3), get(4), get(5)};
  const double xx = get(6), yy = get(7), zz = get(8), xy = get(9), xz = get(10), yz = get(11);
  shape.hessian = Imath::M33d(xx, xy, xz, xy, yy, yz, xz, yz, zz);
  shape.interpolationError = get(12);
  return shape;
}

void ShapeBlock::move(std::size_t i, const Imath::V3d& by, bool isDrawn) {
  const Imath::V3d change = by * at(i).hessian;
  for (std::size_t p = 0; p < (isDrawn ? 6u : 3u); ++p)
    part[p][i] =
        static_cast<float>(static_cast<double>(part[p][i]) + change[static_cast<int>(p % 3)]);
}

void ShapeBlock::flush(std::size_t i) {
  for (std::vector<float>& p : part)
    if (std::abs(p[i]) < std::numeric_limits<float>::min()) p[i] = 0;
}

}  // namespace render
