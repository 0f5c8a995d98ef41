#pragma once

// Solids with radii of curvature close to a voxel, in voxels. Edge detection may find false edges
// on them. Some of these placements once did.

#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/bands.h"

namespace support {

struct RoundedSolid {
  std::string name;
  std::function<double(const Imath::V3d&)> distance;
  double reach;

  [[nodiscard]] levelset::NarrowBand band() const {
    return sampleBand(distance, {Imath::V3d(-reach), Imath::V3d(reach)}, 1);
  }
};

inline RoundedSolid roundedBox(double radius, const Imath::V3d& half, const Imath::V3d& centre,
                               const Imath::V3d& angles) {
  Imath::M44d back;
  back.setEulerAngles(angles);
  back.transpose();
  return {"box rounded by " + std::to_string(radius),
          [=](const Imath::V3d& p) {
            Imath::V3d q;
            back.multDirMatrix(p - centre, q);
            Imath::V3d out;
            double inside = -1e9;
            for (int axis = 0; axis < 3; ++axis) {
              const double d = std::abs(q[axis]) - half[axis];
              out[axis] = std::max(d, 0.0);
              inside = std::max(inside, d);
            }
            return out.length() + std::min(inside, 0.0) - radius;
          },
          half.length() + radius + 1};
}

inline RoundedSolid slenderTorus(double tube, double radius, const Imath::V3d& centre) {
  return {"torus of tube " + std::to_string(tube),
          [=](const Imath::V3d& p) {
            const Imath::V3d q = p - centre;
            return std::hypot(std::hypot(q.x, q.y) - radius, q.z) - tube;
          },
          radius + tube + 1};
}

inline std::vector<RoundedSolid> roundedSolids() {
  using Imath::V3d;
  return {slenderTorus(2.4, 7.2, V3d(0.5)),
          slenderTorus(2.4, 7.2, V3d(0.5, 0.5, 0)),
          slenderTorus(3, 9, V3d(0.3, 0.1, 0.7)),
          roundedBox(1, V3d(6.2, 5.9, 7.5), V3d(0.3, 0.1, 0.5), V3d(0.4, 1.1, 0.2)),
          roundedBox(1, V3d(7, 5, 6), V3d(0.5, 0.5, 0), V3d(0)),
          roundedBox(1.45, V3d(7.2, 4.9, 8.5), V3d(0, 0.5, 0.5), V3d(0)),
          roundedBox(1.45, V3d(8.9, 4.2, 4.8), V3d(0.5, 0.5, 0.5), V3d(0)),
          roundedBox(1.89, V3d(6.2, 7.1, 5.3), V3d(0.5, 0, 0), V3d(0)),
          roundedBox(1.81, V3d(6.2, 5.2, 4.1), V3d(0.2, 0.6, 0.4), V3d(0.3, 0.5, 0.7)),
          roundedBox(2.4, V3d(6, 5, 7), V3d(0.1, 0.6, 0.3), V3d(1.3, 0.4, 2)),
          roundedBox(3.2, V3d(5, 6, 4), V3d(0.7, 0.2, 0.5), V3d(0.6, 1, 0.2)),
          roundedBox(4, V3d(4, 5, 6), V3d(0.5), V3d(0))};
}

}  // namespace support
