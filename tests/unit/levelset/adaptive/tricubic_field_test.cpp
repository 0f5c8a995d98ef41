// Tricubic adaptive fields: the interpolant, its order, tolerance, continuity, meshes and CSG.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <random>
#include <vector>

#include "levelset/adaptive/adaptive_csg.h"
#include "levelset/adaptive/adaptive_field.h"
#include "levelset/adaptive/adaptive_to_mesh.h"
#include "levelset/adaptive/build_adaptive.h"
#include "levelset/adaptive/mesh_distance.h"
#include "levelset/adaptive/mesh_to_adaptive.h"
#include "levelset/adaptive/octree/leaf_interpolant.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/mesh_files/mesh_file.h"
#include "tests/support/adaptive.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace tricubic_field_test {

using namespace levelset;
using Imath::Box3d;
using Imath::V3d;
using support::errorsOf;
using support::FormulaDistance;

const FormulaDistance kBall([](const V3d& p) { return p.length() - 1; });
const Box3d kBallBox(V3d(-1), V3d(1));

/// Interpolant of a function on the cell from `low`, with differences for its derivatives.
template <class Function>
LeafInterpolant interpolantOf(const Function& f, const V3d& low, double edge) {
  LeafInterpolant leaf;
  leaf.isTricubic = true;
  for (int c = 0; c < 8; ++c) {
    const V3d p = low + V3d(c & 1, c >> 1 & 1, c >> 2) * edge;
    leaf.values[static_cast<std::size_t>(c)] = f(p);
    for (int axis = 0; axis < 3; ++axis) {
      V3d step(0);
      step[axis] = 1e-4;
      leaf.slopes[static_cast<std::size_t>(axis)][static_cast<std::size_t>(c)] =
          edge * (f(p + step) - f(p - step)) / 2e-4;
    }
  }
  return leaf;
}

TEST(LeafInterpolant, ReproducesCubicPolynomials) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int k = 0; k < 50; ++k) {
    std::array<double, 20> terms;
    for (double& t : terms) t = unit(random);
    const auto cubic = [&](const V3d& p) {
      double sum = 0;
      std::size_t n = 0;
      for (int i = 0; i <= 3; ++i)
        for (int j = 0; i + j <= 3; ++j)
          for (int l = 0; i + j + l <= 3; ++l)
            sum += terms[n++] * std::pow(p.x, i) * std::pow(p.y, j) * std::pow(p.z, l);
      return sum;
    };
    const V3d low(unit(random), unit(random), unit(random));
    const double edge = 0.3;
    const LeafInterpolant leaf = interpolantOf(cubic, low, edge);
    const V3d at = V3d(0.5) + V3d(unit(random), unit(random), unit(random)) * 0.5;
    EXPECT_NEAR(leaf.value(at), cubic(low + at * edge), 3e-8);  // differences; measured 1e-8
    for (int axis = 0; axis < 3; ++axis) {
      V3d step(0);
      step[axis] = 1e-4;
      const V3d p = low + at * edge;
      EXPECT_NEAR(leaf.slope(at)[axis] / edge, (cubic(p + step) - cubic(p - step)) / 2e-4, 1e-6);
    }
  }
}

TEST(LeafInterpolant, IsTheSameOnPartsOfAFace) {
  // The interpolant of the quarter of a face, from figures of the whole, is that of the whole.
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(0, 1);
  LeafInterpolant whole;
  whole.isTricubic = true;
  for (double& v : whole.values) v = unit(random);
  for (auto& slopes : whole.slopes)
    for (double& s : slopes) s = unit(random);
  LeafInterpolant part;
  part.isTricubic = true;
  for (int c = 0; c < 8; ++c) {
    const V3d at = V3d(c & 1, c >> 1 & 1, c >> 2) * 0.5;
    const auto corner = static_cast<std::size_t>(c);
    // Beyond the face, corners have other figures.
    const bool isOnFace = (c & 1) == 0;
    part.values[corner] = isOnFace ? whole.value(at) : unit(random);
    const V3d slope = whole.slope(at) * 0.5;
    for (int axis = 0; axis < 3; ++axis)
      part.slopes[static_cast<std::size_t>(axis)][corner] =
          isOnFace && axis != 0 ? slope[axis] : unit(random);
  }
  for (int k = 0; k < 100; ++k) {
    const V3d at(0, unit(random), unit(random));
    EXPECT_NEAR(part.value(at), whole.value(at * 0.5), 1e-14);
  }
}

TEST(TricubicField, MeetsItsToleranceWithFewLeaves) {
  const FormulaDistance torus(
      [](const V3d& p) { return std::hypot(std::hypot(p.x, p.y) - 1, p.z) - 0.3; });
  const struct {
    const FormulaDistance* distance;
    Box3d box;
    double share;  ///< most memory beside the trilinear field of tolerance 1e-3
  } shapes[] = {{&kBall, kBallBox, 0.03},                                     // measured 0.018
                {&torus, {V3d(-1.3, -1.3, -0.3), V3d(1.3, 1.3, 0.3)}, 0.1}};  // measured 0.056
  for (const auto& shape : shapes) {
    std::vector<std::size_t> leaves;
    for (const double tolerance : {1.6e-2, 1e-3, 6.25e-5}) {
      AdaptiveReport report;
      const AdaptiveField field =
          buildAdaptive(*shape.distance, shape.box,
                        {.tolerance = tolerance, .halfWidth = 0.1, .isTricubic = true}, &report);
      EXPECT_TRUE(field.isTricubic());
      const support::AdaptiveErrors errors = errorsOf(field, *shape.distance, 100000);
      EXPECT_LE(errors.largest, 0.8);  // measured up to 0.51
      EXPECT_LE(report.testedError + report.hangingError, tolerance);
      EXPECT_EQ(errors.wrongSigns, 0u);
      leaves.push_back(field.leafCount());
      if (tolerance != 1e-3) continue;
      const AdaptiveField linear =
          buildAdaptive(*shape.distance, shape.box, {.tolerance = tolerance, .halfWidth = 0.1});
      EXPECT_LE(double(field.memoryUse()), shape.share * double(linear.memoryUse()));
    }
    // The error of a cell grows with the fourth power of its edge: in a layer of constant
    // thickness, the number of leaves grows with the power 3/4 of 1 / tolerance. A trilinear field
    // has the power 3/2.
    const double order = std::log(double(leaves[2]) / double(leaves[1])) / std::log(16.0);
    EXPECT_NEAR(order, 0.75, 0.2);
  }
}

TEST(TricubicField, MeetsItsToleranceAtKinks) {
  const FormulaDistance hollow([](const V3d& p) {
    const V3d q(std::abs(p.x) - 1, std::abs(p.y) - 0.7, std::abs(p.z) - 0.5);
    const V3d beyond(std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0));
    return std::abs(beyond.length() + std::min(0.0, std::max({q.x, q.y, q.z}))) - 0.05;
  });
  for (const double tolerance : {0.04, 0.02}) {
    const AdaptiveField field =
        buildAdaptive(hollow, {V3d(-1.05, -0.75, -0.55), V3d(1.05, 0.75, 0.55)},
                      {.tolerance = tolerance, .halfWidth = 0.2, .isTricubic = true});
    const support::AdaptiveErrors errors = errorsOf(field, hollow, 100000);
    EXPECT_LE(errors.largest, 1);
    EXPECT_EQ(errors.wrongSigns, 0u);
  }
}

TEST(TricubicField, MeetsItsToleranceForMeshes) {
  const TriMesh box = support::boxMesh(V3d(-1, -0.6, -0.4), V3d(0.8, 0.6, 0.5)),
                torus = support::torusMesh(1, 0.3);
  for (const TriMesh* mesh : {&box, &torus}) {
    const AdaptiveField field =
        meshToAdaptive(*mesh, {.tolerance = 0.004, .halfWidth = 0.1, .isTricubic = true}).field;
    const MeshDistance truth(*mesh, 0.01, {});
    const support::AdaptiveErrors errors = errorsOf(field, truth, 50000);
    EXPECT_LE(errors.largest, 1);
    EXPECT_EQ(errors.wrongSigns, 0u);
    const support::FaceJumps jumps = support::faceJumps(*field.shared());
    EXPECT_GT(jumps.changes, 1000);
    EXPECT_LE(jumps.largest, 5e-7);  // rounding to float
  }
}

TEST(SlowTricubicField, MeetsItsToleranceOnTheDragon) {
  const std::filesystem::path file =
      std::filesystem::path(LEVELSMITH_DATA_DIR) / "models/dragon_vrip.ply.gz";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing: run data/fetch";
  const TriMesh mesh = readMesh(file);
  const double diagonal = bounds(mesh).size().length(), halfWidth = diagonal / 100;
  const AdaptiveField field = meshToAdaptive(mesh, {.tolerance = 3e-3 * diagonal,
                                                    .halfWidth = halfWidth,
                                                    .isTricubic = true,
                                                    .acceptSign = true})
                                  .field;
  const MeshDistance truth(mesh, diagonal / 1000, {.acceptSign = true});
  const AdaptiveSampler sampler(field);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> offset(-0.5 * halfWidth, 0.5 * halfWidth);
  double largest = 0;
  for (std::size_t n = 0; n < 200000; ++n) {
    const V3d p = mesh.positions[random() % mesh.positions.size()] +
                  V3d(offset(random), offset(random), offset(random));
    largest = std::max(largest, std::abs(sampler.value(p) - truth.at(p, {})));
  }
  EXPECT_LE(largest / field.tolerance(), 1);  // measured 0.7
}

TEST(TricubicField, SamplesGradients) {
  const AdaptiveField field =
      buildAdaptive(kBall, kBallBox, {.tolerance = 1e-4, .halfWidth = 0.1, .isTricubic = true});
  const AdaptiveSampler sampler(field);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-1, 1);
  double largest = 0;
  for (int k = 0; k < 1000; ++k) {
    const V3d normal = V3d(unit(random), unit(random), unit(random)).normalized();
    largest = std::max(largest, (sampler.gradient(normal) - normal).length());
  }
  EXPECT_LE(largest, 0.01);
  EXPECT_GT(largest, 1e-5);
}

TEST(TricubicField, HasTheSameBitsOnAllThreads) {
  const TriMesh mesh = support::torusMesh(1, 0.3);
  const auto build = [&] {
    return meshToAdaptive(mesh, {.tolerance = 0.01, .isTricubic = true}).field;
  };
  const AdaptiveField one = support::onThreads(1, build), three = support::onThreads(3, build);
  EXPECT_EQ(one.contentHash(), three.contentHash());
  EXPECT_NE(one.contentHash(), meshToAdaptive(mesh, {.tolerance = 0.01}).field.contentHash());
}

TEST(TricubicField, HasAClosedMeshWithinItsTolerance) {
  for (const double tolerance : {8e-3, 2e-3, 5e-4}) {
    const AdaptiveField field = buildAdaptive(
        kBall, kBallBox, {.tolerance = tolerance, .halfWidth = 0.05, .isTricubic = true});
    const TriMesh mesh = adaptiveToMesh(field);
    EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
    EXPECT_EQ(measure(mesh).euler, 2);
    double largest = 0;
    for (const V3d& p : mesh.positions) largest = std::max(largest, std::abs(p.length() - 1));
    EXPECT_LE(largest, 1.5 * tolerance);
    const double error = std::abs(signedVolume(mesh) - 4.18879020478639);
    // Errors of the interpolant cancel, so they do not fall evenly.
    EXPECT_LE(error, 0.2 * tolerance * 12.566);  // measured up to 0.08 of tolerance and area
  }
}

TEST(TricubicField, StaysTricubicInSetOperations) {
  const auto boxAt = [](double x, bool isTricubic) {
    return meshToAdaptive(support::boxMesh(V3d(x), V3d(x + 1)),
                          {.tolerance = 0.02, .halfWidth = 0.1, .isTricubic = isTricubic})
        .field;
  };
  const std::array both{boxAt(0, true), boxAt(0.5, true)}, mixed{boxAt(0, true), boxAt(0.5, false)};
  const AdaptiveField joined = combineAdaptive(CsgOperation::Union, both),
                      difference = combineAdaptive(CsgOperation::Difference, mixed);
  EXPECT_TRUE(joined.isTricubic());
  EXPECT_FALSE(difference.isTricubic());
  EXPECT_NEAR(signedVolume(adaptiveToMesh(joined)), 1.875, 0.04);
  EXPECT_NEAR(signedVolume(adaptiveToMesh(difference)), 0.875, 0.04);
  // Distances of the union: below one cube, and beyond the edge between both.
  const AdaptiveSampler sampler(joined);
  EXPECT_NEAR(sampler.value(V3d(0.3, 0.3, -0.05)), 0.05, 0.02);
  EXPECT_NEAR(sampler.value(V3d(0.47, 0.2, 1.04)), 0.04, 0.02);
  const AdaptiveField larger = offsetAdaptive(both[0], 0.05);
  EXPECT_TRUE(larger.isTricubic());
  EXPECT_NEAR(AdaptiveSampler(larger).value(V3d(0.5, 0.5, 1.1)), 0.05, 0.02);
}

TEST(MeshDistance, HasTheGradientOfTheDistance) {
  const TriMesh torus = support::torusMesh(1, 0.4, 24, 12);
  const MeshDistance distance(torus, 0.01, {});
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(-1.5, 1.5);
  int kinks = 0;
  for (int k = 0; k < 2000; ++k) {
    const V3d p(unit(random), unit(random), unit(random) / 3);
    const double value = distance.at(p, {});
    const V3d gradient = distance.gradient(p, value, 0);
    EXPECT_NEAR(gradient.length(), 1, 1e-12);
    kinks += (gradient - distance.SignedDistance::gradient(p, value, 1e-6)).length() > 1e-4;
  }
  EXPECT_LE(kinks, 3);
  // At a vertex: the pseudonormal.
  const V3d p = torus.positions[0];
  const V3d ring = V3d(p.x, p.y, 0).normalized();
  EXPECT_GT(distance.gradient(p, 0, 0).dot((p - ring).normalized()), 0.95);
}

}  // namespace tricubic_field_test
