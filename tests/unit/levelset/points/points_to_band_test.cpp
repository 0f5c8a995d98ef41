#include "levelset/points/surface/points_to_band.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/points/processing/sample_mesh.h"
#include "tests/support/bands.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace points_to_band_test {

using Imath::V3d;
using Imath::V3f;
using levelset::InvalidInput;
using levelset::PointCloud;
using levelset::PointMethod;
using levelset::pointsToBand;
using levelset::PointsToBandOptions;
using levelset::PointsToBandResult;
using levelset::UsageError;
using support::measured;
using support::refusal;

constexpr PointMethod kMethods[] = {PointMethod::Meshless, PointMethod::MovingLeastSquares,
                                    PointMethod::MultilevelPartition};

struct SampledShape {
  PointCloud cloud;
  std::function<double(const V3d&)> distance;
  double spacing;
};

/// Points of a sphere of radius 1 with their true normals.
SampledShape ball(std::size_t count, bool isBlueNoise = true) {
  PointCloud cloud =
      sampleMesh(support::sphereMesh(1, V3d(0), 48), {.count = count, .isBlueNoise = isBlueNoise});
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    cloud.positions[i].normalize();
    cloud.normals[i] = V3f(cloud.positions[i]);
  }
  return {std::move(cloud), [](const V3d& p) { return p.length() - 1; },
          std::sqrt(4 * M_PI / static_cast<double>(count) * 2 / std::sqrt(3.0))};
}

/// Points of a torus of radius 1 with a tube of radius 0.4, with their true normals.
SampledShape ring(std::size_t count) {
  PointCloud cloud = sampleMesh(support::torusMesh(1, 0.4, 192, 96), {.count = count});
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const V3d p = cloud.positions[i], onCircle = V3d(p.x, p.y, 0).normalized();
    const V3d normal = (p - onCircle).normalized();
    cloud.normals[i] = V3f(normal);
    cloud.positions[i] = onCircle + 0.4 * normal;
  }
  return {std::move(cloud),
          [](const V3d& p) { return std::hypot(std::hypot(p.x, p.y) - 1, p.z) - 0.4; },
          std::sqrt(4 * M_PI * M_PI * 0.4 / static_cast<double>(count) * 2 / std::sqrt(3.0))};
}

/// Largest error of the distances on each side of the surface: inside, outside.
std::pair<double, double> largestErrors(const PointsToBandResult& result,
                                        const SampledShape& shape) {
  std::pair<double, double> worst{0, 0};
  support::forEachActive(result.band, [&](const V3d& at, double value) {
    const double truth = shape.distance(at), error = std::abs(value - truth);
    (truth < 0 ? worst.first : worst.second) =
        std::max(truth < 0 ? worst.first : worst.second, error);
  });
  return worst;
}

long euler(const levelset::TriMesh& mesh) {
  const auto triangles = static_cast<long>(mesh.triangles.size());
  return static_cast<long>(mesh.positions.size()) - triangles / 2;
}

TEST(PointsToBand, ConvergesOnBothSides) {
  // Largest errors at 8,000 points in spacings, and orders between 500 and 8,000 points.
  constexpr double kErrors[2][2] = {{0.0137, 0.0282}, {6.1e-5, 7.1e-4}};
  constexpr double kOrders[2][2] = {{1.99, 1.70}, {3.37, 3.34}};
  for (const std::size_t m : {0, 1})
    for (const std::size_t s : {0, 1}) {
      const auto worst = [&](std::size_t count) {
        const SampledShape shape = s == 0 ? ball(count) : ring(count);
        const auto [inside, outside] = largestErrors(
            pointsToBand(shape.cloud, shape.spacing / 2, {.method = kMethods[m]}), shape);
        // Neither side is better by more than a tenth.
        EXPECT_NEAR(inside, outside, measured(0.26 * inside));
        return std::max(inside, outside) / shape.spacing;
      };
      const double coarse = worst(500), middle = worst(2000), fine = worst(8000);
      EXPECT_LT(fine, measured(kErrors[m][s]));
      EXPECT_LT(middle, coarse);
      // In units of the spacing, one order less.
      EXPECT_GT(std::log2(coarse / fine) / 2 + 1, support::measuredOrder(kOrders[m][s]));
    }
}

TEST(PointsToBand, MeetsTheTolerance) {
  const SampledShape shape = ring(4000);
  double before = 1;
  for (const double tolerance : {0.1, 0.02, 0.005}) {
    const PointsToBandResult result =
        pointsToBand(shape.cloud, shape.spacing / 2,
                     {.method = PointMethod::MultilevelPartition, .tolerance = tolerance});
    EXPECT_LT(result.certificate.meanResidual, tolerance);
    const auto [inside, outside] = largestErrors(result, shape);
    EXPECT_LT(std::max(inside, outside), before);
    before = std::max(inside, outside);
  }
  EXPECT_LT(before / shape.spacing, measured(0.0222));
}

TEST(PointsToBand, MultilevelPartitionIsNotBentByCellsWithoutPoints) {
  // Cells in the middle of a ball have few points, all on one side of it.
  const SampledShape shape = ball(16000);
  const auto [inside, outside] = largestErrors(
      pointsToBand(shape.cloud, shape.spacing, {.method = PointMethod::MultilevelPartition}),
      shape);
  EXPECT_LT(std::max(inside, outside) / shape.spacing, measured(0.0085));
}

TEST(PointsToBand, RadialBasisConverges) {
  // All points are centres, because none meets the tolerance.
  const auto worst = [](std::size_t count) {
    const SampledShape shape = ring(count);
    const auto [inside, outside] =
        largestErrors(pointsToBand(shape.cloud, shape.spacing / 2,
                                   {.method = PointMethod::RadialBasis, .tolerance = 1e-6}),
                      shape);
    EXPECT_NEAR(inside, outside, measured(0.26 * inside));
    return std::max(inside, outside) / shape.spacing;
  };
  const double coarse = worst(250), fine = worst(1000);
  EXPECT_LT(fine, measured(0.00356));
  EXPECT_GT(std::log2(coarse / fine) + 1, support::measuredOrder(3.35));
}

TEST(PointsToBand, RadialBasisTakesAsManyCentresAsItsToleranceNeeds) {
  const SampledShape shape = ring(6000);
  const PointsToBandResult result =
      pointsToBand(shape.cloud, 0.05, {.method = PointMethod::RadialBasis, .tolerance = 0.02});
  const PointsToBandResult finer =
      pointsToBand(shape.cloud, 0.05, {.method = PointMethod::RadialBasis, .tolerance = 0.002});
  EXPECT_GE(result.certificate.centres, 1500u);
  EXPECT_LT(result.certificate.centres, finer.certificate.centres);
  EXPECT_LE(finer.certificate.centres, shape.cloud.size());
  const auto [inside, outside] = largestErrors(result, shape);
  EXPECT_LT(std::max(inside, outside) / shape.spacing, measured(0.008));
}

TEST(PointsToBand, RadialBasisSmoothsNoise) {
  SampledShape shape = ring(1500);
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 0.2 * shape.spacing);
  for (std::size_t i = 0; i < shape.cloud.size(); ++i)
    shape.cloud.positions[i] += noise(random) * V3d(shape.cloud.normals[i]);
  const auto mean = [&](double lambda) {
    const PointsToBandResult result = pointsToBand(
        shape.cloud, shape.spacing / 2, {.method = PointMethod::RadialBasis, .lambda = lambda});
    double sum = 0, count = 0;
    support::forEachActive(result.band, [&](const V3d& at, double value) {
      sum += std::abs(value - shape.distance(at));
      ++count;
    });
    return sum / count / shape.spacing;
  };
  EXPECT_LT(mean(0), measured(0.122));
  EXPECT_LT(mean(30), measured(0.04));
}

TEST(PointsToBand, RadialBasisBridgesAGap) {
  SampledShape shape = ball(1500);
  PointCloud open;
  const double radius = 2.5 * shape.spacing;
  for (std::size_t i = 0; i < shape.cloud.size(); ++i)
    if ((shape.cloud.positions[i] - V3d(0, 0, 1)).length() > radius) {
      open.positions.push_back(shape.cloud.positions[i]);
      open.normals.push_back(shape.cloud.normals[i]);
    }
  shape.cloud = open;
  const auto worst = [&](PointMethod method) {
    const auto [inside, outside] = largestErrors(
        pointsToBand(shape.cloud, shape.spacing / 2, {.method = method, .acceptUnsupported = true}),
        shape);
    return std::max(inside, outside) / shape.spacing;
  };
  EXPECT_LT(worst(PointMethod::RadialBasis), measured(0.0074));
  EXPECT_GT(worst(PointMethod::MovingLeastSquares), 0.1);
}

TEST(PointsToBand, RadialBasisKeepsTheTopologyOfPlatesAndBoxes) {
  // A plate of 1.5 spacings, and a cube.
  const double spacing = 0.1, half = 0.75 * spacing;
  const PointCloud clouds[] = {
      sampleMesh(support::boxMesh(V3d(-1, -1, -half), V3d(1, 1, half)), {.spacing = spacing}),
      sampleMesh(support::boxMesh(V3d(-1), V3d(1)), {.count = 1200}),
      sampleMesh(support::boxMesh(V3d(-1), V3d(1)), {.count = 1200, .isBlueNoise = false})};
  for (const PointCloud& cloud : clouds) {
    const levelset::TriMesh mesh =
        bandToMesh(pointsToBand(cloud, spacing / 2, {.method = PointMethod::RadialBasis}).band);
    EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
    EXPECT_EQ(euler(mesh), 2);
  }
}

TEST(PointsToBand, ClosesAHoleAndSaysSo) {
  const SampledShape shape = ball(4000);
  PointCloud open;
  for (std::size_t i = 0; i < shape.cloud.size(); ++i)
    if (shape.cloud.positions[i].z < 0.8) {
      open.positions.push_back(shape.cloud.positions[i]);
      open.normals.push_back(shape.cloud.normals[i]);
    }
  for (const PointMethod method : kMethods) {
    PointsToBandOptions options{.method = method};
    EXPECT_SAYS(refusal<InvalidInput>([&] { (void)pointsToBand(open, 0.04, options); }),
                "of the surface is a guess");
    options.acceptUnsupported = true;
    const PointsToBandResult result = pointsToBand(open, 0.04, options);
    const levelset::TriMesh mesh = bandToMesh(result.band);
    EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
    EXPECT_EQ(euler(mesh), 2);
    // The disc across the hole, less a rim of two spacings, has a share of 0.06.
    EXPECT_NEAR(result.certificate.unsupportedShare(), 0.054, 0.01);
    // The ball without its cap, of height 0.2, and the whole ball.
    const double volume = measure(result.band).volume, ballVolume = 4 * M_PI / 3;
    EXPECT_GT(volume, ballVolume - M_PI * 0.04 * (3 - 0.2) / 3);
    EXPECT_LT(volume, ballVolume);
  }
}

TEST(PointsToBand, KeepsThinSheetsApart) {
  const double spacing = 0.05, half = 1.5 * spacing;
  const PointCloud cloud =
      sampleMesh(support::boxMesh(V3d(-1, -1, -half), V3d(1, 1, half)), {.spacing = spacing});
  constexpr double kErrors[3] = {0.0116, 2.5e-5, 2.5e-5};
  for (const std::size_t m : {0, 1, 2}) {
    const levelset::TriMesh mesh =
        bandToMesh(pointsToBand(cloud, spacing / 4, {.method = kMethods[m]}).band);
    EXPECT_EQ(euler(mesh), 2);
    double worst = 0;
    for (const V3d& p : mesh.positions)
      if (std::max(std::abs(p.x), std::abs(p.y)) < 0.8)
        worst = std::max(worst, std::abs(std::abs(p.z) - half));
    EXPECT_LT(worst / spacing, measured(kErrors[m]));
  }
}

TEST(PointsToBand, KeepsTheTopologyOfABox) {
  // Largest errors at the edges, in spacings.
  constexpr double kErrors[2][3] = {{0.62, 0.39, 1e-4}, {1.39, 0.92, 0.2}};
  for (const std::size_t isUneven : {0, 1}) {
    const PointCloud cloud = sampleMesh(support::boxMesh(V3d(-1), V3d(1)),
                                        {.count = 6000, .isBlueNoise = isUneven == 0});
    for (const std::size_t m : {0, 1, 2}) {
      const PointsToBandResult result = pointsToBand(cloud, 0.03, {.method = kMethods[m]});
      const levelset::TriMesh mesh = bandToMesh(result.band);
      EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
      // Known defect: on uneven points, mpu leaves a handle of about a voxel beside an edge.
      EXPECT_EQ(euler(mesh), isUneven == 1 && m == 2 ? 0 : 2);
      double worst = 0;
      for (const V3d& p : mesh.positions)
        worst =
            std::max(worst, std::abs(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) - 1));
      EXPECT_LT(worst / result.certificate.medianSpacing, measured(kErrors[isUneven][m])) << m;
    }
  }
}

TEST(PointsToBand, DoesNotDependOnThePlaceOrTheScale) {
  const SampledShape shape = ball(2000);
  const double voxel = 1.0 / 16;
  const PointsToBandResult reference = pointsToBand(shape.cloud, voxel);
  // A power of two scales all numbers exactly, down to a spacing of 1e-9.
  PointCloud small = shape.cloud;
  const double scale = std::ldexp(1.0, -26);
  for (V3d& p : small.positions) p *= scale;
  const PointsToBandResult scaled = pointsToBand(small, scale * voxel);
  ASSERT_EQ(scaled.band.activeVoxelCount(), reference.band.activeVoxelCount());
  EXPECT_DOUBLE_EQ(scaled.certificate.meanResidual, reference.certificate.meanResidual);
  PointCloud away = shape.cloud;
  const V3d shift(1e6, -1e6, 1e6);
  for (V3d& p : away.positions) p += shift;
  const PointsToBandResult moved = pointsToBand(away, voxel);
  double worst = 0;
  support::forEachActive(moved.band, [&](const V3d& at, double value) {
    worst = std::max(worst, std::abs(value - ((at - shift).length() - 1)));
  });
  double here = 0;
  support::forEachActive(reference.band, [&](const V3d& at, double value) {
    here = std::max(here, std::abs(value - (at.length() - 1)));
  });
  EXPECT_LT(here, measured(7.3e-5));
  EXPECT_NEAR(worst, here, 1e-8);
}

TEST(PointsToBand, HasTheSameBitsOnAnyNumberOfThreads) {
  const SampledShape shape = ring(2000);
  for (const PointMethod method : {PointMethod::Meshless, PointMethod::MovingLeastSquares,
                                   PointMethod::MultilevelPartition, PointMethod::RadialBasis}) {
    const auto run = [&] { return pointsToBand(shape.cloud, 0.05, {.method = method}); };
    const PointsToBandResult one = support::onThreads(1, run), four = support::onThreads(4, run);
    EXPECT_EQ(one.band.contentHash(), four.band.contentHash());
    EXPECT_EQ(one.support.contentHash(), four.support.contentHash());
    EXPECT_EQ(one.certificate.area, four.certificate.area);
  }
}

TEST(PointsToBand, CountsPointsAtOnePlaceOnce) {
  const SampledShape shape = ball(1000);
  PointCloud doubled = shape.cloud;
  for (int copy = 0; copy < 3; ++copy)
    for (std::size_t i = 0; i < shape.cloud.size(); ++i) {
      doubled.positions.push_back(shape.cloud.positions[i]);
      doubled.normals.push_back(shape.cloud.normals[i]);
    }
  const PointsToBandResult once = pointsToBand(shape.cloud, 0.05),
                           often = pointsToBand(doubled, 0.05);
  EXPECT_EQ(often.certificate.points, shape.cloud.size());
  EXPECT_EQ(once.band.contentHash(), often.band.contentHash());
}

TEST(PointsToBand, MeasuresAreaAndSupport) {
  const SampledShape shape = ball(4000);
  const PointsToBandResult result = pointsToBand(shape.cloud, 0.03);
  EXPECT_NEAR(result.certificate.area / (4 * M_PI), 1, measured(1.4e-4));
  EXPECT_NEAR(result.certificate.medianSpacing, shape.spacing, measured(0.003 * shape.spacing));
  EXPECT_EQ(result.certificate.unsupportedArea, 0);
  EXPECT_NEAR(result.certificate.largestGap, 0.89, 0.1);
}

TEST(PointsToBand, RefusesCloudsWithoutASurface) {
  const auto refused = [](PointCloud cloud, double voxel = 0.1) {
    return refusal<InvalidInput>([&] { (void)pointsToBand(cloud, voxel); });
  };
  PointCloud cloud = ball(500).cloud;
  EXPECT_SAYS(refused({}), "empty");
  EXPECT_SAYS(refused({.positions = cloud.positions}), "no normals");
  PointCloud bad = cloud;
  bad.normals[7] = V3f(0);
  EXPECT_SAYS(refused(bad), "1 of 500 points have no normal");
  bad = cloud;
  bad.positions[3].y = std::nan("");
  EXPECT_FALSE(refused(bad).empty());
  PointCloud one{.positions = std::vector<V3d>(1000000, V3d(1, 2, 3)),
                 .normals = std::vector<V3f>(1000000, V3f(0, 0, 1))};
  EXPECT_SAYS(refused(one), "1 different positions");
  PointCloud line;
  for (int i = 0; i < 100; ++i) {
    line.positions.push_back(V3d(1, 2, 3) * (0.1 * i) + V3d(5, 0, 0));
    line.normals.push_back(V3f(0, 0, 1));
  }
  EXPECT_SAYS(refused(line), "on one line");
  PointCloud plane;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 20; ++j) {
      plane.positions.push_back(V3d(0.1 * i, 0.1 * j, 0));
      plane.normals.push_back(V3f(0, 0, 1));
    }
  EXPECT_SAYS(refused(plane, 0.05), "guess");
  bad = cloud;
  for (std::size_t i = 0; i < bad.size(); i += 2) bad.normals[i] = -bad.normals[i];
  EXPECT_SAYS(refused(bad), "oppose");
  EXPECT_FALSE(refused(cloud, 10).empty());
}

TEST(PointsToBand, RefusesOptionsOutOfRange) {
  const PointCloud cloud = ball(500).cloud;
  const auto refused = [&](const PointsToBandOptions& options) {
    return refusal<UsageError>([&] { (void)pointsToBand(cloud, 0.1, options); });
  };
  EXPECT_SAYS(refused({.neighbours = 5}), "give 6 to 1000");
  EXPECT_SAYS(refused({.neighbours = 1001}), "give 6 to 1000");
  EXPECT_SAYS(refused({.halfWidth = 0.5}), "half width");
  EXPECT_SAYS(refused({.tolerance = 0}), "tolerance");
  EXPECT_SAYS(refused({.lambda = -1}), "lambda");
  EXPECT_THROW((void)pointsToBand(cloud, 0.1, {.maxMemory = 1000}), levelset::ResourceLimit);
  EXPECT_THROW((void)pointsToBand(cloud, 0.1, {.progress = [](double f) { return f < 0.5; }}),
               levelset::Cancelled);
}

}  // namespace points_to_band_test
