#pragma once

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ctime>
#include <vector>

#include "mapping/maps/patch_map.h"
#include "tests/support/formula_patches.h"

/// A third of a cylinder's wall, and grid points over it, to time maps.
namespace wall {

constexpr double kTextureVoxels = 256;  // voxels along the unit cube
constexpr double kTolerance = 0.05;     // texture voxels
constexpr double kAngle = 2.1, kLength = 4.2, kInner = 2, kHeight = 0.6;

/// CPU seconds.
inline double now() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

/// Position of a texture point. Slightly irregular, like relaxed particles, and slightly wavy, so
/// that no map is exact.
inline Imath::V3d place(const Imath::V3d& uvw) {
  const double angle = kAngle * (uvw.x - 0.5) + 0.02 * std::sin(7 * uvw.y),
               r = kInner + kHeight * uvw.z;
  return {r * std::sin(angle), kLength * uvw.y + 0.05 * std::sin(9 * uvw.x), r * std::cos(angle)};
}

inline mapping::Patch makePatch(double particles, double levels) {
  const auto side =
      static_cast<std::size_t>(std::max(4.0, std::round(std::sqrt(particles / levels))));
  return support::patchAt(place, side, side, static_cast<std::size_t>(levels), kHeight);
}

/// Root blocks of 64³ over the entire wall, with about `points` grid points inside.
inline std::vector<mapping::GridBlock> rootsOf(double points) {
  const double outer = kInner + kHeight;
  const double volume = kAngle * kLength * 0.5 * (outer * outer - kInner * kInner);
  const double step = std::cbrt(volume / points);
  Imath::M33d rows;
  for (int i = 0; i < 3; ++i) rows[i][i] = step;
  constexpr int kEdge = 64;
  std::vector<mapping::GridBlock> roots;
  for (double x = -2.7; x < 2.7; x += kEdge * step)
    for (double y = -0.2; y < 4.4; y += kEdge * step)
      for (double z = 0.7; z < 2.7; z += kEdge * step)
        roots.push_back({Imath::V3d(x, y, z), rows, kEdge});
  return roots;
}

inline bool holds(const mapping::GridBlock& block) {
  const Imath::V3d c = block.center();
  const double r = std::hypot(c.x, c.z);
  return r > kInner && r < kInner + kHeight && std::abs(std::atan2(c.x, c.z)) < 0.5 * kAngle &&
         c.y > 0 && c.y < kLength;
}

}  // namespace wall
