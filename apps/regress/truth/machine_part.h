#pragma once

#include <vector>

#include "apps/regress/truth/truth.h"
#include "levelset/mesh.h"

namespace regress {

/// Plate with a chamfered corner and a round hole through it: planes, obtuse and right angles, and
/// a curved edge. Its longest side is 1, and its bounding box is centred at the origin.
struct MachinePart {
  Truth truth;                      ///< exact distance, volume and area
  levelset::TriMesh mesh;           ///< faces outwards; the wall of the hole has 1440 facets
  std::vector<Imath::V3d> edges;    ///< points on the sharp edges
  std::vector<Imath::V3d> corners;  ///< the ten corners
};

[[nodiscard]] MachinePart machinePart(const Imath::M44d& placement);

}  // namespace regress
