// Adaptive distance fields: their error, continuity and signs, and meshes without cracks.

#include "levelset/adaptive/adaptive_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "levelset/adaptive/adaptive_to_mesh.h"
#include "levelset/adaptive/build_adaptive.h"
#include "levelset/adaptive/mesh_distance.h"
#include "levelset/adaptive/mesh_to_adaptive.h"
#include "levelset/adaptive/octree/adaptive_tree.h"
#include "levelset/adaptive/octree/hanging_nodes.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "tests/support/adaptive.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace adaptive_field_test {

using namespace levelset;
using Imath::Box3d;
using Imath::V3d;
using Imath::V3i;

using Formula = support::FormulaDistance;
using Errors = support::AdaptiveErrors;
using support::errorsOf;

const Formula kBall([](const V3d& p) { return p.length() - 1; });
const Box3d kBallBox(V3d(-1), V3d(1));

TEST(AdaptiveField, MeetsItsToleranceAroundABall) {
  std::vector<std::size_t> leaves;
  for (const double tolerance : {4e-3, 1e-3, 2.5e-4}) {
    const AdaptiveField field =
        buildAdaptive(kBall, kBallBox, {.tolerance = tolerance, .halfWidth = 0.1});
    const Errors errors = errorsOf(field, kBall, 50000);
    EXPECT_LE(errors.largest, 0.6);  // measured 0.28 to 0.5
    EXPECT_EQ(errors.wrongSigns, 0u);
    EXPECT_GT(errors.inside, 2000u);
    EXPECT_GT(errors.outside, 2000u);
    leaves.push_back(field.leafCount());
  }
  // The error of a cell is quadratic in its edge: in a layer of constant thickness, the number of
  // leaves grows with the power 3/2 of 1 / tolerance. Levels are powers of two, so it does in
  // steps.
  const double order = std::log(double(leaves[2]) / double(leaves[0])) / std::log(16.0);
  EXPECT_NEAR(order, 1.5, 0.3);
}

/// The distance of a box has kinks on both sides: inside on the medial axis, outside none but at
/// infinity. A hollow box has them on both.
void expectToleranceEverywhere(const std::vector<double>& tolerances, int points) {
  const Formula hollow([](const V3d& p) {
    const V3d q(std::abs(p.x) - 1, std::abs(p.y) - 0.7, std::abs(p.z) - 0.5);
    const V3d beyond(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return std::abs(beyond.length() + std::min(0.0, std::max({q.x, q.y, q.z}))) - 0.05;
  });
  for (const double tolerance : tolerances) {
    const AdaptiveField field =
        buildAdaptive(hollow, {V3d(-1.05, -0.75, -0.55), V3d(1.05, 0.75, 0.55)},
                      {.tolerance = tolerance, .halfWidth = 0.5});
    const Errors errors = errorsOf(field, hollow, points);
    EXPECT_LE(errors.largest, 1);
    EXPECT_EQ(errors.wrongSigns, 0u);
    EXPECT_GT(errors.inside, static_cast<std::size_t>(points) / 40);
    EXPECT_GT(errors.outside, static_cast<std::size_t>(points) / 4);
  }
}

TEST(AdaptiveField, MeetsItsToleranceEverywhere) {
  expectToleranceEverywhere({0.04, 0.02, 0.01}, 50000);
}

TEST(SlowAdaptiveField, MeetsItsToleranceAtAMillionPoints) {
  expectToleranceEverywhere({0.02}, 1000000);
  for (const bool isTricubic : {false, true}) {
    const TriMesh torus = support::torusMesh(1, 0.3);
    const AdaptiveField field =
        meshToAdaptive(torus, {.tolerance = 0.004, .halfWidth = 0.1, .isTricubic = isTricubic})
            .field;
    const Errors errors = errorsOf(field, MeshDistance(torus, 0.01, {}), 1000000);
    EXPECT_LE(errors.largest, 1) << isTricubic;
    EXPECT_EQ(errors.wrongSigns, 0u) << isTricubic;
    EXPECT_GT(errors.inside, 10000u);
    EXPECT_GT(errors.outside, 10000u);
  }
}

TEST(AdaptiveField, FindsPartsThinnerThanItsTolerance) {
  // A plate of a fifth of the tolerance, turned.
  const V3d axis = V3d(1, 2, 3).normalized();
  const Formula plate([&](const V3d& p) {
    const double height = p.dot(axis), radius = (p - axis * height).length();
    const double across = std::abs(height) - 0.002, along = radius - 0.8;
    return std::hypot(std::max(across, 0.0), std::max(along, 0.0)) +
           std::min(0.0, std::max(across, along));
  });
  const AdaptiveField field =
      buildAdaptive(plate, {V3d(-0.85), V3d(0.85)}, {.tolerance = 0.01, .halfWidth = 0.1});
  const Errors errors = errorsOf(field, plate, 50000);
  EXPECT_LE(errors.largest, 1);
  EXPECT_EQ(errors.wrongSigns, 0u);
}

TEST(AdaptiveField, IsContinuousAcrossHangingNodes) {
  const TriMesh mesh = support::boxMesh(V3d(-1, -0.6, -0.4), V3d(0.8, 0.6, 0.5));
  const AdaptiveField field = meshToAdaptive(mesh, {.tolerance = 0.004, .halfWidth = 0.2}).field;
  const support::FaceJumps jumps = support::faceJumps(*field.shared());
  EXPECT_GT(jumps.changes, 1000);
  EXPECT_LE(jumps.largest, 3e-7);  // rounding of values below 2 to float; measured 1.2e-7
}

/// Splits random leaves and updates the data of the tree around them.
void expectUpdates(bool isTricubic) {
  // Values that no interpolant has, so that each hanging node takes one over.
  std::mt19937 random(21);
  AdaptiveTree tree{HashedOctree(6), {}, V3d(0), 1, 1, 1};
  std::map<std::array<int, 3>, std::array<float, 4>> known;
  const auto split = [&](const CellKey& leaf) {
    tree.octree.split(leaf);
    CornerValues& values = tree.data.values.emplace_back();
    if (isTricubic) tree.data.gradients.emplace_back();
    const int half = static_cast<int>(leaf.edge() / 2);
    for (int z = 0; z < 3; ++z)
      for (int y = 0; y < 3; ++y)
        for (int x = 0; x < 3; ++x) {
          const V3i p = leaf.low() + V3i(x, y, z) * half;
          const auto [it, isNew] = known.try_emplace({p.x, p.y, p.z});
          if (isNew)
            for (float& number : it->second) number = static_cast<float>(random() % 1000);
          const auto i = static_cast<std::size_t>(x + 3 * y + 9 * z);
          values[i] = it->second[3];
          for (std::size_t axis = 0; axis < 3 && isTricubic; ++axis)
            tree.data.gradients.back()[axis][i] = it->second[axis];
        }
  };
  const auto randomLeaf = [&] {
    const auto at = [&] { return static_cast<int>(random() % 64); };
    return tree.octree.leafAt(V3i(at(), at(), at()));
  };
  split(tree.octree.root());
  CornerData data = continuousData(tree);
  for (int round = 0; round < 100; ++round) {
    const auto first = static_cast<std::uint32_t>(tree.octree.blockCount());
    for (int k = 0; k < 1 + round % 3; ++k)
      if (const CellKey leaf = randomLeaf(); leaf.level > 0) split(leaf);
    const CornerData before = data;
    const std::vector<std::uint32_t> computed = updateData(tree, first, data);
    ASSERT_EQ(data, continuousData(tree)) << "round " << round;
    for (std::uint32_t block = 0; block < before.values.size(); ++block)
      if (data.values[block] != before.values[block] ||
          (isTricubic && data.gradients[block] != before.gradients[block])) {
        EXPECT_TRUE(std::binary_search(computed.begin(), computed.end(), block));
      }
  }
}

TEST(AdaptiveField, UpdatesTheValuesAroundNewLeaves) {
  expectUpdates(false);
  expectUpdates(true);
}

TEST(AdaptiveField, HasTheSameBitsOnAllThreads) {
  const TriMesh mesh = support::torusMesh(1, 0.3);
  const auto build = [&] { return meshToAdaptive(mesh, {.tolerance = 0.005}).field; };
  const AdaptiveField one = support::onThreads(1, build), three = support::onThreads(3, build);
  EXPECT_EQ(one.contentHash(), three.contentHash());
  const auto meshOf = [&] { return adaptiveToMesh(one); };
  const TriMesh a = support::onThreads(1, meshOf), b = support::onThreads(3, meshOf);
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(AdaptiveField, MovesWithTheMesh) {
  // Far from the origin the same cells have the same errors.
  const TriMesh mesh = support::torusMesh(1, 0.3);
  const TriMesh far = support::transformed(mesh, [](const V3d& p) { return p + V3d(1e6); });
  const AdaptiveField near = meshToAdaptive(mesh, {.tolerance = 0.01}).field,
                      there = meshToAdaptive(far, {.tolerance = 0.01}).field;
  EXPECT_NEAR(double(there.leafCount()), double(near.leafCount()), 0.01 * double(near.leafCount()));
  const MeshDistance truth(far, 0.01, {});
  EXPECT_LE(errorsOf(there, truth, 50000).largest, 1);
}

TEST(AdaptiveField, SamplesBeyondItsRoot) {
  const AdaptiveField field = buildAdaptive(kBall, kBallBox, {.tolerance = 0.01});
  const AdaptiveSampler sampler(field);
  EXPECT_NEAR(sampler.value(V3d(10, 0, 0)), 9, 0.05);
  EXPECT_NEAR(sampler.value(V3d(-100, 50, 3)), V3d(-100, 50, 3).length() - 1, 1);
  EXPECT_TRUE(std::isnan(sampler.value(V3d(NAN, 0, 0))));
  EXPECT_TRUE(std::isnan(sampler.gradient(V3d(0, INFINITY, 0)).x));
  const V3d slope = sampler.gradient(V3d(0.6, 0.6, 0.6));
  EXPECT_NEAR((slope - V3d(1).normalized()).length(), 0, 0.15);  // measured 0.06
}

/// Finds a part of a thousandth of a box, at random places that no lattice of a large cell hits.
void expectDetailIsFound(unsigned seed, int places) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int place = 0; place < places; ++place) {
    const double y = 0.1 + 0.8 * unit(random), z = 0.1 + 0.8 * unit(random);
    const TriMesh mesh =
        support::joined(support::boxMesh(V3d(0), V3d(1)),
                        support::boxMesh(V3d(1.001, y, z), V3d(1.002, y + 0.001, z + 0.001)));
    const AdaptiveField field = meshToAdaptive(mesh, {.tolerance = 4e-4, .halfWidth = 2e-3}).field;
    const MeshDistance truth(mesh, 0.01, {});
    const AdaptiveSampler sampler(field);
    double largest = 0;
    for (int k = 0; k < 20000; ++k) {
      // Beside the detail, and in the column above it.
      const V3d p = V3d(1, y - 0.002, z - 0.002) +
                    V3d(0.003 * unit(random), 0.005 * unit(random), 0.005 * unit(random));
      const double distance = truth.at(p, {});
      if (std::abs(distance) < field.halfWidth())
        largest = std::max(largest, std::abs(sampler.value(p) - distance));
    }
    EXPECT_LE(largest, field.tolerance());
    EXPECT_LT(sampler.value(V3d(1.0015, y + 5e-4, z + 5e-4)), 0);
    // A grid of the size of the smallest cells along one face alone has 16 million cells.
    EXPECT_LT(field.leafCount(), 900000u);  // measured 604,598
  }
}

TEST(AdaptiveField, FindsDetailOnAFlatFace) {
  expectDetailIsFound(2, 1);
}

TEST(SlowAdaptiveField, FindsDetailAtMorePlaces) {
  expectDetailIsFound(2, 2);
}

TEST(AdaptiveField, RefusesBadOptions) {
  const auto build = [](double tolerance, double halfWidth) {
    return buildAdaptive(kBall, kBallBox, {.tolerance = tolerance, .halfWidth = halfWidth});
  };
  EXPECT_THROW((void)build(0, 0), UsageError);
  EXPECT_THROW((void)build(-1, 0), UsageError);
  EXPECT_THROW((void)build(NAN, 0), UsageError);
  EXPECT_THROW((void)build(1e-7, 0), UsageError);
  EXPECT_THROW((void)build(0.1, -1), UsageError);
  EXPECT_THROW((void)build(0.1, NAN), UsageError);
  EXPECT_THROW((void)build(0.1, INFINITY), UsageError);
  EXPECT_THROW((void)buildAdaptive(kBall, Box3d(), {.tolerance = 0.1}), InvalidInput);
  EXPECT_THROW((void)buildAdaptive(kBall, {V3d(1e15), V3d(1e15 + 1)}, {.tolerance = 0.01}),
               InvalidInput);
  EXPECT_THROW((void)buildAdaptive(kBall, kBallBox, {.tolerance = 1e-3, .maxMemory = 100000}),
               ResourceLimit);
  int calls = 0;
  const auto cancel = [&](double) { return ++calls < 4; };
  EXPECT_THROW((void)buildAdaptive(kBall, kBallBox, {.tolerance = 1e-3, .progress = cancel}),
               Cancelled);
  EXPECT_THROW((void)meshToAdaptive(TriMesh(), {.tolerance = 1}), InvalidInput);
  TriMesh mesh = support::boxMesh(V3d(0), V3d(1));
  mesh.triangles[0][1] = 77;
  EXPECT_THROW((void)meshToAdaptive(mesh, {.tolerance = 0.1}), InvalidInput);
  mesh = support::boxMesh(V3d(0), V3d(1));
  mesh.positions[2].y = INFINITY;
  EXPECT_THROW((void)meshToAdaptive(mesh, {.tolerance = 0.1}), InvalidInput);
  EXPECT_THROW((void)meshToAdaptive(support::boxMesh(V3d(3), V3d(3)), {.tolerance = 0.1}),
               InvalidInput);
}

/// Union of random balls.
Formula ballsOf(std::mt19937& random, int count) {
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<std::pair<V3d, double>> balls;
  for (int k = 0; k < count; ++k) {
    const V3d centre(unit(random), unit(random), unit(random));
    balls.emplace_back(centre, 0.05 + 0.5 * std::abs(unit(random)));
  }
  return Formula([balls](const V3d& p) {
    double least = INFINITY;
    for (const auto& [centre, radius] : balls)
      least = std::min(least, (p - centre).length() - radius);
    return least;
  });
}

/// Tests meshes of unions of random balls. Half widths of zero or so leave large cells beside small
/// ones.
void expectClosedManifolds(unsigned seed, int count) {
  std::mt19937 random(seed);
  for (int k = 0; k < count; ++k) {
    const Formula balls = ballsOf(random, 1 + k % 8);
    const AdaptiveField field =
        buildAdaptive(balls, {V3d(-1.6), V3d(1.6)},
                      {.tolerance = 0.03 + 0.01 * (k % 5), .halfWidth = k % 2 ? 1e-3 : 0.3});
    const TriMesh mesh = adaptiveToMesh(field);
    ASSERT_FALSE(mesh.isEmpty());
    EXPECT_TRUE(manifoldness(mesh).isClosedManifold()) << k;
    EXPECT_GT(signedVolume(mesh), 0);
  }
}

TEST(AdaptiveToMesh, IsAClosedManifold) {
  expectClosedManifolds(7, 40);
}

TEST(SlowAdaptiveToMesh, IsAClosedManifold) {
  expectClosedManifolds(7, 100);
}

TEST(AdaptiveToMesh, ConvergesOnABall) {
  double last = 0;
  for (const double tolerance : {8e-3, 2e-3, 5e-4}) {
    const TriMesh mesh =
        adaptiveToMesh(buildAdaptive(kBall, kBallBox, {.tolerance = tolerance, .halfWidth = 0.05}));
    double largest = 0;
    for (const V3d& p : mesh.positions) largest = std::max(largest, std::abs(p.length() - 1));
    EXPECT_LE(largest, tolerance);
    const double error = std::abs(signedVolume(mesh) - 4.18879020478639);
    if (last > 0) {
      EXPECT_NEAR(std::log(last / error) / std::log(4.0), 1, 0.35);
    }
    last = error;
    EXPECT_EQ(measure(mesh).euler, 2);
  }
}

TEST(AdaptiveToMesh, MeshesNothingFromNothing) {
  EXPECT_TRUE(adaptiveToMesh(AdaptiveField()).isEmpty());
  const Formula far([](const V3d& p) { return p.length() + 1; });
  const AdaptiveField field = buildAdaptive(far, kBallBox, {.tolerance = 0.1});
  EXPECT_TRUE(adaptiveToMesh(field).isEmpty());
  EXPECT_TRUE(field.zeroSetBounds().isEmpty());
}

/// Compares signs and distances with brute force at random points near a mesh.
void expectDistance(const TriMesh& mesh, const MeshToBandOptions& options,
                    const std::function<bool(const V3d&)>& isInside) {
  const MeshDistance distance(mesh, 0.01, options);
  const Box3d box = bounds(mesh);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(-0.1, 1.1);
  for (int k = 0; k < 3000; ++k) {
    V3d p;
    for (int axis = 0; axis < 3; ++axis)
      p[axis] = box.min[axis] + unit(random) * (box.max[axis] - box.min[axis]);
    const double found = distance.at(p, {});
    EXPECT_EQ(found < 0, isInside(p)) << p.x << " " << p.y << " " << p.z;
    if (distance.certificate().selfIntersections <= 0) {
      EXPECT_NEAR(std::abs(found), support::unsignedDistance(mesh, p), 1e-12);
    }
    // A known value must not change the answer.
    const V3d other = p + V3d(unit(random), unit(random), unit(random)) * 0.3;
    const SignedDistance::Known known{distance.at(other, {}), (p - other).length()};
    EXPECT_NEAR(distance.at(p, known), found, 1e-12);
  }
}

TEST(MeshDistance, AgreesWithBruteForce) {
  const TriMesh torus = support::torusMesh(1, 0.4, 24, 12);
  const auto isInside = [&](const V3d& p) { return std::abs(windingNumber(torus, p)) > 0.5; };
  expectDistance(torus, {}, isInside);
  expectDistance(support::reversed(torus), {}, isInside);
  expectDistance(support::reversed(torus), {.sign = SignMode::Winding}, isInside);
}

TEST(MeshDistance, NestsByParityAndOrientation) {
  const TriMesh outer = support::sphereMesh(1, V3d(0), 8),
                middle = support::sphereMesh(0.6, V3d(0), 8),
                inner = support::sphereMesh(0.3, V3d(0), 8);
  const auto depth = [&](const V3d& p) {
    int count = 0;
    for (const TriMesh* mesh : {&outer, &middle, &inner})
      count += std::abs(windingNumber(*mesh, p)) > 0.5;
    return count;
  };
  for (const bool isReversed : {false, true}) {
    const TriMesh nested = support::joined(
        outer, support::joined(isReversed ? support::reversed(middle) : middle, inner));
    expectDistance(nested, {}, [&](const V3d& p) { return depth(p) % 2 == 1; });
  }
  // By orientation: solid, cavity, solid.
  const TriMesh oriented =
      support::joined(outer, support::joined(support::reversed(middle), inner));
  expectDistance(oriented, {.nesting = Nesting::Orientation},
                 [&](const V3d& p) { return depth(p) % 2 == 1; });
}

TEST(MeshDistance, IgnoresSheetsInsideOverlappingParts) {
  const TriMesh a = support::sphereMesh(0.7, V3d(-0.4, 0, 0), 10),
                b = support::sphereMesh(0.7, V3d(0.41, 0.03, 0.02), 10);
  const TriMesh both = support::joined(a, b);
  expectDistance(both, {}, [&](const V3d& p) { return windingNumber(both, p) > 0.5; });
  const MeshDistance distance(both, 0.01, {});
  EXPECT_GT(distance.certificate().selfIntersections, 0);
  // The rim of the lens between the balls is the nearest part of the surface.
  EXPECT_LT(distance.at(V3d(0.3, 0, 0), {}), -0.5);  // 0.57 to the rim; the hidden sheet is at 0.01
}

TEST(MeshDistance, SpansHoles) {
  const TriMesh cap = support::sphereMesh(1, V3d(0), 24, 0.9);
  const MeshDistance distance(cap, 0.02, {});
  EXPECT_GT(distance.certificate().boundaryEdges, 0u);
  EXPECT_EQ(distance.certificate().method, SignMode::Winding);
  int wrong = 0;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1.2, 1.2);
  for (int k = 0; k < 2000; ++k) {
    const V3d p(unit(random), unit(random), unit(random));
    wrong += (distance.at(p, {}) < 0) != (windingNumber(cap, p) > 0.5);
  }
  EXPECT_LE(wrong, 2);  // measured 0; the span is a dual surface
  const AdaptiveField field = meshToAdaptive(cap, {.tolerance = 0.02, .acceptSign = true}).field;
  const TriMesh mesh = adaptiveToMesh(field);
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  EXPECT_EQ(measure(mesh).euler, 2);
}

TEST(MeshDistance, RefusesTrianglesOfOppositeOrientations) {
  TriMesh box = support::boxMesh(V3d(0), V3d(1));
  std::swap(box.triangles[3][0], box.triangles[3][1]);
  EXPECT_THROW((void)meshToAdaptive(box, {.tolerance = 0.01}), InvalidInput);
}

TEST(MeshDistance, RefusesAmbiguousSigns) {
  // A bowl: half of its span is a guess.
  const TriMesh bowl = support::sphereMesh(1, V3d(0), 16, 0.5);
  EXPECT_THROW((void)meshToAdaptive(bowl, {.tolerance = 0.05}), InvalidInput);
  const TriMesh mesh =
      adaptiveToMesh(meshToAdaptive(bowl, {.tolerance = 0.08, .acceptSign = true}).field);
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());

  TriMesh sheet;
  sheet.positions = {V3d(0), V3d(1, 0, 0), V3d(0, 1, 0)};
  sheet.triangles = {{0, 1, 2}};
  EXPECT_THROW((void)meshToAdaptive(sheet, {.tolerance = 0.01}), InvalidInput);
}

}  // namespace adaptive_field_test
