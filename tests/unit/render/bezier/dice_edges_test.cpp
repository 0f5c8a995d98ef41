// Edges of a die under free-form deformation, beside the images of its edges in closed form.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "render/bezier/bezier_view.h"
#include "render/bezier/shared_tree.h"
#include "tests/support/bezier_scenes.h"

namespace dice_edges_test {

using bezier_scenes::V3d;
using Imath::V2d;
using render::BezierRoot;
using render::BezierVolume;
using render::Camera;
using render::SharedTree;

constexpr int kSize = 200;

Camera dieCamera() {
  Camera camera;
  camera.from = V3d(3.2, -4.1, 2.7);
  camera.up = V3d(0, 0, 1);
  camera.width = camera.height = kSize;
  return camera;
}

/// Images of the twelve edges of the cube, as lines of points in pixels.
std::vector<std::vector<V2d>> edgesOnScreen(const BezierVolume& die, const Camera& camera) {
  constexpr int kPoints = 2000;
  const render::BezierView view(camera);
  std::vector<std::vector<V2d>> edges;
  for (int axis = 0; axis < 3; ++axis)
    for (const double a : {-1.0, 1.0})
      for (const double b : {-1.0, 1.0}) {
        std::vector<V2d>& edge = edges.emplace_back();
        for (int n = 0; n <= kPoints; ++n) {
          V3d p;
          p[axis] = 2.0 * n / kPoints - 1;
          p[(axis + 1) % 3] = a;
          p[(axis + 2) % 3] = b;
          const V3d from = positionAt(die.patches[0], (p + V3d(1.2)) / 2.4) - view.eye;
          const double depth = from.dot(view.axis);
          edge.emplace_back(from.dot(view.right) / depth / view.step.x + view.middle.x,
                            from.dot(view.down) / depth / view.step.y + view.middle.y);
        }
      }
  return edges;
}

double distanceFrom(const std::vector<std::vector<V2d>>& edges, const V2d& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const std::vector<V2d>& edge : edges)
    for (std::size_t n = 1; n < edge.size(); ++n) {
      const V2d along = edge[n] - edge[n - 1], from = p - edge[n - 1];
      const double t = std::clamp(from.dot(along) / along.length2(), 0.0, 1.0);
      least = std::min(least, (from - along * t).length());
    }
  return least;
}

/// Number of the face of the cube that a position of the picture shows; nothing on pips, and beside
/// the die.
struct Seen {
  std::optional<int> face;
  double depth = 0;
};
Seen seenAt(const SharedTree& tree, const V2d& at) {
  const SharedTree::Roots found = tree.rootsAt({at}, nullptr);
  if (found.roots.empty() || found.roots[0].attribute > 2) return {};
  const BezierRoot& root = found.roots[0];
  const int axis = static_cast<int>(root.attribute);
  return {2 * axis + (root.parameter[axis] > 0.5 ? 1 : 0), root.depth};
}

TEST(DiceEdges, LieOnTheImagesOfTheEdgesOfTheCube) {
  const BezierVolume die = bezier_scenes::dice();
  const Camera camera = dieCamera();
  const std::vector<std::vector<V2d>> edges = edgesOnScreen(die, camera);
  const SharedTree tree(die, camera);
  std::vector<Seen> picture;
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) picture.push_back(seenAt(tree, V2d(x + 0.5, y + 0.5)));
  std::size_t changes = 0;
  double ofPixels = 0, ofRays = 0;
  for (int y = 0; y + 1 < kSize; ++y)
    for (int x = 0; x + 1 < kSize; ++x)
      for (const V2d& step : {V2d(1, 0), V2d(0, 1)}) {
        const auto number = static_cast<std::size_t>(y * kSize + x);
        const Seen& here = picture[number];
        const Seen& there = picture[number + (step.x > 0 ? 1 : kSize)];
        if (!here.face || !there.face || *here.face == *there.face) continue;
        // Without a jump of the depth, this is an edge, not a silhouette.
        if (std::abs(here.depth - there.depth) > 0.1) continue;
        V2d low(x + 0.5, y + 0.5), high = low + step;
        ofPixels = std::max(ofPixels, distanceFrom(edges, (low + high) * 0.5));
        ++changes;
        if (changes % 4 != 0) continue;
        for (int halving = 0; halving < 24; ++halving) {
          const V2d middle = (low + high) * 0.5;
          (seenAt(tree, middle).face == here.face ? low : high) = middle;
        }
        ofRays = std::max(ofRays, distanceFrom(edges, low));
      }
  EXPECT_GT(changes, 150U);
  EXPECT_LE(ofPixels, 0.5);  // the promise, with one ray for each pixel
  EXPECT_LE(ofRays, 3e-6);   // measured 1.1e-6, of the chords of the lines
}

}  // namespace dice_edges_test
