#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cmath>

#include "tests/support/bands.h"

/// Solids that carry patches, and corners of patches on them.
namespace support {

/// Ball about the origin.
inline levelset::NarrowBand makeBall(double radius, double voxel, double halfWidth = 3) {
  return sampleBand([=](const Imath::V3d& p) { return p.length() - radius; },
                    {Imath::V3d(-radius), Imath::V3d(radius)}, voxel, halfWidth);
}

/// Corners of a square, anticlockwise seen from above.
inline std::array<Imath::V3d, 4> square(double half, double z = 0) {
  using Imath::V3d;
  return {V3d(-half, -half, z), V3d(half, -half, z), V3d(half, half, z), V3d(-half, half, z)};
}

/// Corners on a ball about the origin, all at the angle `polar` from +z.
inline std::array<Imath::V3d, 4> cap(double polar, double radius = 1) {
  return square(radius * std::sin(polar) / std::sqrt(2.0), radius * std::cos(polar));
}

}  // namespace support
