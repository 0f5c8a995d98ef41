// Exact crossings of meshes and the edges of the tetrahedra of the grid.

#include "levelset/segmented/sources/grid_crossings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "levelset/segmented/local/kuhn_cell.h"
#include "tests/support/meshes.h"

namespace grid_crossings_test {

using namespace levelset;
using Imath::V3d;
using Imath::V3i;

const V3i kLow(-20);

std::map<GridSimplices::Key, int> countCrossings(const TriMesh& mesh) {
  std::map<GridSimplices::Key, int> counts;
  for (const GridCrossing& crossing :
       findGridCrossings(mesh.positions, mesh.triangles, GridSimplices(kLow)))
    ++counts[crossing.edge];
  return counts;
}

/// Faces of tetrahedra whose border crosses a mesh an odd number of times.
std::size_t oddFaces(const std::map<GridSimplices::Key, int>& counts) {
  const GridSimplices simplices(kLow);
  std::map<GridSimplices::Key, int> sums;
  for (const auto& [key, count] : counts) {
    const V3i at = simplices.pointOf(key);
    const std::uint32_t step = GridSimplices::slotOf(key) + 1;
    for (const kuhn::FaceSteps& face : kuhn::kFaces) {
      const std::uint32_t slot = kuhn::faceSlot(face.middle, face.upper);
      if (face.middle == step || face.upper == step) sums[simplices.key(at, slot)] += count;
      if ((face.middle ^ face.upper) == step)
        sums[simplices.key(at - offsetOfCorner(face.middle), slot)] += count;
    }
  }
  std::size_t odd = 0;
  for (const auto& [face, sum] : sums) odd += sum % 2 != 0;
  return odd;
}

TEST(GridCrossings, CrossClosedMeshesAnEvenNumberOfTimes) {
  // Corners, edges and faces of the boxes lie on grid points, edges and diagonals.
  const TriMesh box = support::boxMesh(V3d(-3, -2, -4), V3d(3, 4, 1));
  EXPECT_EQ(oddFaces(countCrossings(box)), 0u);
  TriMesh octahedron;
  octahedron.positions = {{5, 0, 0}, {-5, 0, 0}, {0, 5, 0}, {0, -5, 0}, {0, 0, 5}, {0, 0, -5}};
  octahedron.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                          {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  EXPECT_EQ(oddFaces(countCrossings(octahedron)), 0u);
  EXPECT_EQ(oddFaces(countCrossings(support::sphereMesh(7.3, V3d(0.1, 0.2, 0.3), 12))), 0u);
}

TEST(GridCrossings, MoveTheGridAlongThePositiveAxes) {
  // A box from 0 to 2 holds the moved points 0 and 1, but not 2.
  const auto counts = countCrossings(support::boxMesh(V3d(0), V3d(2)));
  const GridSimplices simplices(kLow);
  const auto count = [&](const V3i& at, std::uint32_t step) {
    const auto found = counts.find(simplices.key(at, kuhn::edgeSlot(step)));
    return found == counts.end() ? 0 : found->second;
  };
  EXPECT_EQ(count({-1, 0, 0}, 4), 1);
  EXPECT_EQ(count({0, 0, 0}, 4), 0);
  EXPECT_EQ(count({1, 0, 0}, 4), 1);
  EXPECT_EQ(count({2, 0, 0}, 4), 0);
  EXPECT_EQ(count({-1, -1, -1}, 7), 1);
  EXPECT_EQ(count({1, 1, 1}, 7), 1);
  EXPECT_EQ(count({2, 2, 2}, 7), 0);
}

TEST(GridCrossings, LieOnTheTriangle) {
  const TriMesh mesh = support::sphereMesh(6.2, V3d(0.13, -0.21, 0.37), 10);
  const GridSimplices simplices(kLow);
  double worst = 0;
  for (const GridCrossing& crossing :
       findGridCrossings(mesh.positions, mesh.triangles, simplices)) {
    const V3d p = V3d(simplices.pointOf(crossing.edge)) +
                  V3d(offsetOfCorner(GridSimplices::slotOf(crossing.edge) + 1)) * crossing.position;
    const auto& t = mesh.triangles[crossing.triangle];
    worst = std::max(worst, (support::closestPoint(mesh.positions[t[0]], mesh.positions[t[1]],
                                                   mesh.positions[t[2]], p) -
                             p)
                                .length());
  }
  EXPECT_LT(worst, 1e-12);
}

TEST(GridCrossings, DoNotDependOnTheOrientation) {
  const TriMesh mesh = support::boxMesh(V3d(-3, -2, -4), V3d(3, 4.5, 1));
  EXPECT_EQ(countCrossings(mesh), countCrossings(support::reversed(mesh)));
}

}  // namespace grid_crossings_test
