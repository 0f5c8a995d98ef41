#pragma once

#include "levelset/mesh.h"

namespace levelset {

/// Shapes of the triangles of a mesh. All figures are zero for a mesh without triangles.
struct MeshQuality {
  double leastAngle = 0;   ///< least angle of all triangles, radians; 0: a triangle has no area
  double meanLeast = 0;    ///< mean of the least angles of the triangles, radians; at most π/3
  double radiusRatio = 0;  ///< mean of twice the radius of the inscribed circle over that of the
                           ///< circumscribed one: 1 for equilateral triangles, 0 without area
  double valenceSix = 0;   ///< share of the vertices with six triangles
  double shortestEdge = 0, longestEdge = 0;  ///< world units
};

/// Measures the shapes of the triangles. Sums run in the order of the triangles.
[[nodiscard]] MeshQuality meshQuality(const TriMesh& mesh);

}  // namespace levelset
