#include "levelset/inspect/mesh_quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace levelset {

using Imath::V3d;

MeshQuality meshQuality(const TriMesh& mesh) {
  MeshQuality quality;
  if (mesh.isEmpty()) return quality;
  quality.leastAngle = quality.shortestEdge = std::numeric_limits<double>::infinity();
  std::vector<std::uint32_t> valence(mesh.positions.size(), 0);
  for (const auto& t : mesh.triangles) {
    std::array<double, 3> sides{};
    double least = std::numeric_limits<double>::infinity(), twiceArea = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      ++valence[t[i]];
      const V3d& corner = mesh.positions[t[i]];
      const V3d u = mesh.positions[t[(i + 1) % 3]] - corner,
                v = mesh.positions[t[(i + 2) % 3]] - corner;
      sides[i] = u.length();
      twiceArea = u.cross(v).length();
      least = std::min(least, std::atan2(twiceArea, u.dot(v)));
      quality.shortestEdge = std::min(quality.shortestEdge, sides[i]);
      quality.longestEdge = std::max(quality.longestEdge, sides[i]);
    }
    quality.leastAngle = std::min(quality.leastAngle, least);
    quality.meanLeast += least;
    // 2 r / R with r = 2 A / (a + b + c) and R = a b c / (4 A).
    const double product = (sides[0] + sides[1] + sides[2]) * sides[0] * sides[1] * sides[2];
    if (product > 0) quality.radiusRatio += 4 * twiceArea * twiceArea / product;
  }
  const auto triangles = static_cast<double>(mesh.triangles.size());
  quality.meanLeast /= triangles;
  quality.radiusRatio /= triangles;
  const auto withTriangles = [&](std::uint32_t count) {
    return static_cast<double>(std::count(valence.begin(), valence.end(), count));
  };
  quality.valenceSix = withTriangles(6) / (static_cast<double>(valence.size()) - withTriangles(0));
  return quality;
}

}  // namespace levelset
