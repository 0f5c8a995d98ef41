#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "levelset/error.h"
#include "levelset/point_files/point_file.h"
#include "levelset/points/processing/outliers.h"
#include "levelset/points/processing/place_points.h"
#include "levelset/points/processing/point_neighbours.h"
#include "levelset/points/processing/point_spacing.h"
#include "levelset/points/processing/sample_mesh.h"
#include "levelset/points/processing/thin.h"
#include "tests/support/files.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace point_processing_test {

using Imath::V3d;
using Imath::V3f;
using levelset::InvalidInput;
using levelset::PointCloud;
using levelset::PointSpacing;
using levelset::pointSpacing;
using levelset::thin;
using levelset::UsageError;
using levelset::withoutOutliers;
using levelset::points::Neighbour;
using levelset::points::PointNeighbours;
using support::refusal;

PointCloud cloudOf(std::vector<V3d> positions) {
  PointCloud cloud;
  cloud.positions = std::move(positions);
  return cloud;
}

std::vector<V3d> randomPoints(std::size_t count, const V3d& shift = V3d(0), double scale = 1) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(0, 1);
  std::vector<V3d> points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back(shift +
                     scale * V3d(coordinate(random), coordinate(random), coordinate(random)));
  return points;
}

std::vector<V3d> lattice(int edge, const V3d& shift = V3d(0), double spacing = 1) {
  std::vector<V3d> points;
  for (int k = 0; k < edge; ++k)
    for (int j = 0; j < edge; ++j)
      for (int i = 0; i < edge; ++i) points.push_back(shift + spacing * V3d(i, j, k));
  return points;
}

/// The `count` nearest points by comparing all of them.
std::vector<std::pair<double, std::uint32_t>> nearestByForce(const std::vector<V3d>& points,
                                                             const V3d& from, std::size_t count) {
  std::vector<std::pair<double, std::uint32_t>> all;
  for (std::uint32_t i = 0; i < points.size(); ++i)
    if (std::find(points.begin(), points.begin() + i, points[i]) == points.begin() + i)
      all.emplace_back((points[i] - from).length2(), i);
  std::sort(all.begin(), all.end());
  all.resize(std::min(count, all.size()));
  return all;
}

void expectNearest(const std::vector<V3d>& points, const V3d& from, std::size_t count) {
  const PointNeighbours tree(points);
  std::vector<Neighbour> found;
  tree.nearest(from, count, found);
  const auto expected = nearestByForce(points, from, count);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].index, expected[i].second);
    EXPECT_EQ(found[i].squared, expected[i].first);
  }
}

// === Neighbours

TEST(PointNeighboursTest, EqualThoseByForce) {
  std::vector<V3d> points = randomPoints(500);
  points.insert(points.end(), points.begin(), points.begin() + 50);  // duplicates
  const std::vector<V3d> queries = randomPoints(40, V3d(-0.5), 2);
  for (const V3d& from : queries)
    for (const std::size_t count : {1, 5, 30}) expectNearest(points, from, count);
  // Equal distances are decided by the number.
  for (const V3d& from : {V3d(2), V3d(1.5, 2, 2), V3d(0)}) expectNearest(lattice(5), from, 7);
  expectNearest(points, V3d(0), 1000);
  expectNearest(lattice(5, V3d(1e6), 1e-9), V3d(1e6), 9);
}

TEST(PointNeighboursTest, WithinARadiusAreAllNearerPoints) {
  const std::vector<V3d> points = randomPoints(700);
  const PointNeighbours tree(points);
  std::vector<Neighbour> found;
  for (const V3d& from : randomPoints(20)) {
    tree.within(from, 0.2, found);
    std::vector<std::uint32_t> expected, numbers;
    for (std::uint32_t i = 0; i < points.size(); ++i)
      if ((points[i] - from).length2() < 0.2 * 0.2) expected.push_back(i);
    for (const Neighbour& one : found) numbers.push_back(one.index);
    EXPECT_EQ(numbers, expected);
  }
}

TEST(PointNeighboursTest, DuplicatesCountOnce) {
  const std::vector<V3d> points = {V3d(1), V3d(0), V3d(1), V3d(-0.0, 0, 0), V3d(1)};
  const PointNeighbours tree(points);
  EXPECT_EQ(tree.size(), 2u);
  EXPECT_EQ(tree.duplicates(), 3u);
  EXPECT_EQ(tree.first(4), 0u);
  EXPECT_EQ(tree.first(3), 1u);
}

// === Spacing

TEST(PointSpacingTest, OfALatticeIsItsEdge) {
  const PointSpacing spacing = pointSpacing(cloudOf(lattice(6, V3d(3), 0.25)));
  EXPECT_EQ(spacing.duplicates, 0u);
  for (const double value : {spacing.mean, spacing.median, spacing.percentile5,
                             spacing.percentile95, spacing.least, spacing.greatest})
    EXPECT_EQ(value, 0.25);
}

TEST(PointSpacingTest, DependsOnTheScaleOnly) {
  // 8 spacings of the numbers at 1e6 are 9.3e-10.
  const double edge = 8 * 0x1p-33;
  const PointSpacing far = pointSpacing(cloudOf(lattice(5, V3d(1e6), edge)));
  EXPECT_EQ(far.mean, edge);
  EXPECT_EQ(far.greatest, edge);
}

TEST(PointSpacingTest, WithoutTwoPositionsIsZero) {
  EXPECT_EQ(pointSpacing({}).greatest, 0);
  EXPECT_EQ(pointSpacing(cloudOf({V3d(1)})).greatest, 0);
  const PointSpacing spacing = pointSpacing(cloudOf(std::vector<V3d>(1000000, V3d(1, 2, 3))));
  EXPECT_EQ(spacing.greatest, 0);
  EXPECT_EQ(spacing.duplicates, 999999u);
}

// === Thin

/// Checks the two properties of a Poisson-disk sample.
void expectPoissonDisk(const PointCloud& all, const PointCloud& kept, double radius) {
  ASSERT_FALSE(kept.isEmpty());
  if (kept.size() > 1) {
    const PointSpacing spacing = pointSpacing(kept);
    EXPECT_EQ(spacing.duplicates, 0u);
    EXPECT_GE(spacing.least, radius);
  }
  const PointNeighbours tree(kept.positions);
  std::vector<Neighbour> found;
  for (const V3d& p : all.positions) {
    tree.nearest(p, 1, found);
    ASSERT_LT(std::sqrt(found[0].squared), radius);
  }
}

TEST(Thin, RadiusIsTheLeastDistanceAndCoversAllPoints) {
  for (const double radius : {0.01, 0.07, 0.3, 5.0}) {
    const PointCloud cloud = cloudOf(randomPoints(5000));
    expectPoissonDisk(cloud, thin(cloud, {.radius = radius}), radius);
  }
  const PointCloud far = cloudOf(randomPoints(3000, V3d(1e6), 1e-6));
  expectPoissonDisk(far, thin(far, {.radius = 1e-7}), 1e-7);
  std::vector<V3d> uneven = randomPoints(2000, V3d(0), 1e-9);
  uneven.push_back(V3d(1e6));
  const PointCloud mixed = cloudOf(uneven);
  expectPoissonDisk(mixed, thin(mixed, {.radius = 0.5}), 0.5);
}

TEST(Thin, FarPointsDoNotHideNearOnes) {
  // The farthest points need more than 2^32, 2^53 and 2^64 cells.
  for (const double far : {1e5, 1e12, 1e16, 1e30})
    for (const double sign : {1.0, -1.0}) {
      SCOPED_TRACE(sign * far);
      std::vector<V3d> points = randomPoints(2000, V3d(-0.5), 1e-4);
      for (const V3d& p : randomPoints(200, V3d(far * sign), 0)) points.push_back(p);
      // Neighbours of each other in the last bits, and duplicates.
      for (int i = 0; i < 200; ++i) {
        V3d p(far * sign, -0.5, far * sign);
        for (int k = 0; k < i % 20; ++k) p.x = std::nextafter(p.x, 0);
        points.push_back(p);
      }
      const PointCloud cloud = cloudOf(points);
      for (const double radius : {1e-5, 3e-6}) {
        const PointCloud kept = thin(cloud, {.radius = radius});
        expectPoissonDisk(cloud, kept, radius);
        EXPECT_EQ(support::onThreads(1, [&] { return thin(cloud, {.radius = radius}).positions; }),
                  kept.positions);
      }
      for (const std::size_t count : {10, 500, 1999})
        EXPECT_EQ(thin(cloud, {.count = count}).size(), count);
    }
}

TEST(Thin, AFarPointDoesNotPutAllOthersIntoOneCell) {
  // The test of all pairs in one cell takes half a minute.
  std::vector<V3d> points = randomPoints(100000);
  points.push_back(V3d(1e12, 0, 0));
  EXPECT_EQ(thin(cloudOf(points), {.radius = 1e-6}).size(), 100001u);
  EXPECT_EQ(thin(cloudOf(points), {.count = 30000}).size(), 30000u);
}

TEST(Thin, LatticesOnTheBordersOfFarCellsStay) {
  // The edges of the cells are a little longer than the spacing.
  for (const double spacing : {1.0, 0.1, 1e-3}) {
    std::vector<V3d> points = lattice(12, V3d(-6 * spacing), spacing);
    points.push_back(V3d(1e15));
    const PointCloud cloud = cloudOf(points);
    const double least = pointSpacing(cloud).least;
    EXPECT_EQ(thin(cloud, {.radius = least}).positions, cloud.positions);
    expectPoissonDisk(cloud, thin(cloud, {.radius = 1.5 * spacing}), 1.5 * spacing);
  }
}

TEST(Thin, RadiusBelowTheSpacingKeepsAllPoints) {
  const PointCloud cloud = cloudOf(lattice(8));
  EXPECT_EQ(thin(cloud, {.radius = 1}).positions, cloud.positions);
  EXPECT_LT(thin(cloud, {.radius = 1.001}).size(), cloud.size());
}

TEST(Thin, KeepsAttributesAndOrder) {
  PointCloud cloud = cloudOf(randomPoints(1000));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    cloud.weights.push_back(static_cast<float>(i));
    cloud.normals.emplace_back(cloud.positions[i]);
  }
  for (const levelset::ThinOptions& options :
       {levelset::ThinOptions{.radius = 0.2}, levelset::ThinOptions{.count = 100}}) {
    const PointCloud kept = thin(cloud, options);
    EXPECT_TRUE(std::is_sorted(kept.weights.begin(), kept.weights.end()));
    for (std::size_t i = 0; i < kept.size(); ++i) {
      EXPECT_EQ(cloud.positions[static_cast<std::size_t>(kept.weights[i])], kept.positions[i]);
      EXPECT_EQ(kept.normals[i], V3f(kept.positions[i]));
    }
  }
}

TEST(Thin, CountIsExactAndSpreadEvenly) {
  const levelset::TriMesh sphere = support::sphereMesh(1, V3d(0), 96);
  const PointCloud dense = sampleMesh(sphere, {.count = 40000, .isBlueNoise = false});
  for (const std::size_t count : {10, 500, 4000, 20000, 39999}) {
    const PointCloud kept = thin(dense, {.count = count});
    EXPECT_EQ(kept.size(), count);
    if (count != 4000) continue;
    // Measured: 0.69 of the distance in a hexagonal lattice. Random points have 0.013 of it.
    const double hexagonal = std::sqrt(2 * 4 * M_PI / (std::sqrt(3.0) * 4000));
    EXPECT_GT(pointSpacing(kept).least, 0.64 * hexagonal);
    const PointCloud random = sampleMesh(sphere, {.count = count, .isBlueNoise = false});
    EXPECT_LT(pointSpacing(random).least, 0.035 * hexagonal);
  }
}

TEST(Thin, SurvivesAnyPoints) {
  const PointCloud place = cloudOf(std::vector<V3d>(1000000, V3d(1, 2, 3)));
  EXPECT_EQ(thin(place, {.radius = 0.1}).size(), 1u);
  EXPECT_EQ(thin(place, {.count = 1}).size(), 1u);
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)thin(place, {.count = 2}); }),
              "1 different positions");
  // Many points in a small place and a few far away.
  std::vector<V3d> uneven = randomPoints(30000, V3d(0), 1e-6);
  for (const V3d& p : randomPoints(30)) uneven.push_back(p);
  for (const std::size_t count : {20, 2000}) {
    EXPECT_EQ(thin(cloudOf(uneven), {.count = count}).size(), count);
  }
  std::vector<V3d> line;
  for (int i = 0; i < 1000; ++i) line.emplace_back(i, 2 * i, -i);
  EXPECT_EQ(thin(cloudOf(line), {.count = 100}).size(), 100u);
}

TEST(Thin, RefusesUnusableOptions) {
  const PointCloud cloud = cloudOf(randomPoints(10));
  const auto refused = [&](const levelset::ThinOptions& options) {
    return refusal<UsageError>([&] { (void)thin(cloud, options); });
  };
  EXPECT_SAYS(refused({}), "either a radius or a count");
  EXPECT_SAYS(refused({.radius = 1, .count = 1}), "either a radius or a count");
  EXPECT_SAYS(refused({.radius = 0}), "the radius is not a positive number");
  EXPECT_SAYS(refused({.radius = NAN}), "the radius is not a positive number");
  EXPECT_SAYS(refused({.count = 0}), "the count is 0");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)thin(PointCloud(), {.radius = 1}); }),
              "has no points");
  EXPECT_SAYS(
      refusal<levelset::ResourceLimit>([&] { (void)thin(cloud, {.radius = 1, .maxMemory = 100}); }),
      "memory");
}

// === Outliers

TEST(Outliers, RemovesPlantedPointsOnly) {
  const levelset::TriMesh sphere = support::sphereMesh(1, V3d(0), 96);
  PointCloud cloud = sampleMesh(sphere, {.count = 5000});
  const std::size_t clean = cloud.size();
  for (const double distance : {0.3, 0.5, 2.0, 1e6}) {
    cloud.positions.push_back(V3d(0.6, 0, 0.8) * (1 + distance));
    cloud.normals.push_back(V3f(1, 0, 0));
  }
  const levelset::OutlierResult result = withoutOutliers(cloud);
  EXPECT_EQ(result.removed, 4u);
  EXPECT_EQ(result.cloud.positions,
            std::vector<V3d>(cloud.positions.begin(),
                             cloud.positions.begin() + static_cast<std::ptrdiff_t>(clean)));
  EXPECT_EQ(result.cloud.normals.size(), clean);
  // A second run removes nothing.
  EXPECT_EQ(withoutOutliers(result.cloud).removed, 0u);
}

TEST(Outliers, KeepsLatticesAndSinglePlaces) {
  EXPECT_EQ(withoutOutliers(cloudOf(lattice(7))).removed, 0u);
  EXPECT_EQ(withoutOutliers(cloudOf(lattice(24))).removed, 0u);
  std::vector<V3d> square, line;
  for (int i = 0; i < 10000; ++i) square.emplace_back(i % 100, i / 100, 0);
  EXPECT_EQ(withoutOutliers(cloudOf(square)).removed, 0u);
  // The mean distances of the first two points are 1.9 and 1.7 of the median; the limit is 1.6.
  for (int i = 0; i < 1000; ++i) line.emplace_back(i, 0, 0);
  EXPECT_EQ(withoutOutliers(cloudOf(line)).removed, 4u);
  EXPECT_EQ(withoutOutliers(cloudOf({V3d(1)})).removed, 0u);
  EXPECT_EQ(withoutOutliers(cloudOf({V3d(1), V3d(2)})).removed, 0u);
  EXPECT_EQ(withoutOutliers(cloudOf(std::vector<V3d>(1000000, V3d(5)))).removed, 0u);
  (void)refusal<InvalidInput>([] { (void)withoutOutliers({}); });
  (void)refusal<UsageError>([] { (void)withoutOutliers(cloudOf({V3d(1)}), {.neighbours = 0}); });
  (void)refusal<UsageError>([] { (void)withoutOutliers(cloudOf({V3d(1)}), {.deviations = 0}); });
  EXPECT_SAYS(
      refusal<UsageError>([] { (void)withoutOutliers(cloudOf({V3d(1)}), {.neighbours = 1001}); }),
      "maximum of 1000");
  EXPECT_EQ(withoutOutliers(cloudOf(lattice(5)), {.neighbours = 1000}).removed, 0u);
}

// === Placement

TEST(PlacePoints, NormalsAndRadiiFollowTheMatrix) {
  // Points of an ellipsoid, as the image of a sphere, have the normals of its gradient.
  const levelset::TriMesh sphere = support::sphereMesh(1, V3d(0), 24);
  PointCloud cloud = sampleMesh(sphere, {.count = 300});
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    cloud.positions[i].normalize();
    cloud.normals[i] = V3f(cloud.positions[i]);
    cloud.radii.push_back(0.5f);
  }
  for (const double sign : {1.0, -1.0}) {
    Imath::M44d matrix;
    matrix.setScale(V3d(sign * 2, 4, 1));
    const PointCloud moved = transform(cloud, matrix);
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const V3d p = moved.positions[i];
      EXPECT_NEAR((V3d(moved.normals[i]) - V3d(p.x / 4, p.y / 16, p.z).normalized()).length(), 0,
                  3e-7);
      EXPECT_FLOAT_EQ(moved.radii[i], 1);
    }
  }
  Imath::M44d shift;
  shift.setTranslation(V3d(1, 2, 3));
  EXPECT_EQ(transform(cloud, shift).normals, cloud.normals);
  Imath::M44d flat;
  flat.setScale(V3d(1, 1, 0));
  (void)refusal<UsageError>([&] { (void)transform(cloud, flat); });
  Imath::M44d huge;
  huge.setScale(1e39);
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)transform(cloud, huge); }),
              "a coordinate exceeds 3.4e38");
}

TEST(PlacePoints, ResultsFitIntoFiles) {
  const support::TemporaryFolder folder;
  PointCloud cloud = cloudOf({V3d(0), V3d(1, 0, 0)});
  cloud.radii = {0.5f, 2};
  const auto scaled = [&](double scale) {
    Imath::M44d matrix;
    matrix.setScale(scale);
    return transform(cloud, matrix);
  };
  for (const double scale : {3e38 / 2, 1e38, 1e-38, 1e-44}) {
    writePoints(folder / "a.csv", scaled(scale));
    EXPECT_EQ(levelset::readPoints(folder / "a.csv").positions[1], V3d(scale, 0, 0));
  }
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)scaled(2e38); }), "a radius leaves");
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)scaled(1e-46); }), "a radius leaves");
  // The writer checks coordinates, too: noise can move points beyond the range of files.
  EXPECT_SAYS(refusal<InvalidInput>([&] { writePoints(folder / "a.ply", cloudOf({V3d(1e39)})); }),
              "3.4e38 at point 0");
}

TEST(PlacePoints, ClipKeepsPointsOfTheBoxAndTheHalfSpace) {
  const PointCloud cloud = cloudOf(lattice(5));
  EXPECT_EQ(clip(cloud, Imath::Box3d(V3d(1), V3d(3))).size(), 27u);
  const PointCloud half = clip(cloud, Imath::Plane3d(V3d(0, 0, 1), 1));
  EXPECT_EQ(half.size(), 50u);
  for (const V3d& p : half.positions) EXPECT_LE(p.z, 1);
  (void)refusal<InvalidInput>([&] { (void)clip(cloud, Imath::Box3d(V3d(7), V3d(8))); });
  (void)refusal<UsageError>([&] { (void)clip(cloud, Imath::Box3d()); });
  (void)refusal<UsageError>([&] { (void)clip(cloud, Imath::Plane3d(V3d(0), 1)); });
}

// === Sampling

TEST(SampleMesh, PointsLieOnTheMeshAndFillItByArea) {
  const levelset::TriMesh box = support::boxMesh(V3d(0), V3d(1, 2, 4));
  for (const bool isBlueNoise : {false, true}) {
    const PointCloud cloud = sampleMesh(box, {.count = 4000, .isBlueNoise = isBlueNoise});
    ASSERT_EQ(cloud.size(), 4000u);
    std::size_t onTop = 0;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const V3d& p = cloud.positions[i];
      EXPECT_LT(support::unsignedDistance(box, p), 5e-15);
      // The normal of a face points out of the box.
      EXPECT_GT(V3d(cloud.normals[i]).dot((p - V3d(0.5, 1, 2)) / V3d(0.5, 1, 2)), 0.99);
      onTop += p.z > 4 - 1e-12 ? 1 : 0;
    }
    // The top has 2 of 28 units of area. Independent points deviate by 16 at one standard
    // deviation.
    EXPECT_NEAR(static_cast<double>(onTop), 4000 * 2 / 28.0, isBlueNoise ? 20 : 48);
  }
}

TEST(SampleMesh, NoiseHasItsDeviation) {
  const levelset::TriMesh box = support::boxMesh(V3d(0), V3d(1));
  const levelset::SampleOptions clean{.count = 20000, .isBlueNoise = false};
  levelset::SampleOptions noisy = clean;
  noisy.noise = 0.01;
  const PointCloud a = sampleMesh(box, clean), b = sampleMesh(box, noisy);
  EXPECT_EQ(a.normals, b.normals);
  V3d sum(0), squares(0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const V3d d = b.positions[i] - a.positions[i];
    sum += d;
    squares += d * d;
  }
  for (int axis = 0; axis < 3; ++axis) {
    // Three standard deviations of the mean and of the variance.
    EXPECT_NEAR(sum[axis] / 20000, 0, 3 * 0.01 / std::sqrt(20000.0));
    EXPECT_NEAR(squares[axis] / 20000, 1e-4, 3e-4 * std::sqrt(2 / 20000.0));
  }
  noisy.seed = 2;
  EXPECT_NE(sampleMesh(box, noisy).positions, b.positions);
}

TEST(SampleMesh, SpacingGivesTheCount) {
  const levelset::TriMesh box = support::boxMesh(V3d(0), V3d(1));
  const PointCloud cloud = sampleMesh(box, {.spacing = 0.05, .hasNormals = false});
  EXPECT_EQ(cloud.size(), static_cast<std::size_t>(std::round(6 / (std::sqrt(0.75) * 0.0025))));
  EXPECT_TRUE(cloud.normals.empty());
  // Measured: a mean distance of 0.76 of that of the lattice.
  EXPECT_NEAR(pointSpacing(cloud).mean, 0.76 * 0.05, 0.02 * 0.05);
}

TEST(SampleMesh, PositionsThatCollapseAreAllUsed) {
  // Coordinates near 1e6 are multiples of 1.2e-10, so the triangle has few different ones.
  levelset::TriMesh mesh;
  mesh.positions = {V3d(1e6), V3d(1e6 + 1e-9, 1e6, 1e6), V3d(1e6, 1e6 + 1e-9, 1e6)};
  mesh.triangles = {{0, 1, 2}};
  const PointCloud kept = sampleMesh(mesh, {.count = 8000});
  EXPECT_EQ(kept.size(), 8000u);
  // The candidates are five times as many independent points.
  const PointCloud candidates = sampleMesh(mesh, {.count = 40000, .isBlueNoise = false});
  const std::size_t different = PointNeighbours(candidates.positions).size();
  EXPECT_LT(different, 300u);  // measured: 216
  EXPECT_EQ(PointNeighbours(kept.positions).size(), different);
  // The test of all pairs at one place takes minutes.
  EXPECT_EQ(sampleMesh(mesh, {.count = 100000}).size(), 100000u);
}

TEST(SampleMesh, RefusesUnusableInput) {
  const levelset::TriMesh box = support::boxMesh(V3d(0), V3d(1));
  const auto refused = [&](const levelset::SampleOptions& options) {
    return refusal<UsageError>([&] { (void)sampleMesh(box, options); });
  };
  EXPECT_SAYS(refused({}), "either a count or a spacing");
  EXPECT_SAYS(refused({.count = 0}), "the count is 0");
  EXPECT_SAYS(refused({.spacing = -1}), "the spacing is not a positive number");
  EXPECT_SAYS(refused({.count = 1, .noise = -1}), "the noise is negative");
  EXPECT_SAYS(refusal<levelset::ResourceLimit>([&] { (void)sampleMesh(box, {.spacing = 1e-9}); }),
              "give a smaller count or");
  levelset::TriMesh flat = box;
  for (V3d& p : flat.positions) p = V3d(p.x, 0, 0);
  EXPECT_SAYS(refusal<InvalidInput>([&] { (void)sampleMesh(flat, {.count = 1}); }), "has no area");
}

TEST(PointProcessing, BitsDoNotDependOnThreads) {
  const levelset::TriMesh sphere = support::sphereMesh(1, V3d(0), 48);
  const auto run = [&] {
    const PointCloud dense =
        sampleMesh(sphere, {.count = 60000, .isBlueNoise = false, .noise = 1e-3});
    const PointCloud disk = thin(dense, {.radius = 0.02});
    const PointCloud counted = thin(dense, {.count = 5000});
    const PointSpacing spacing = pointSpacing(dense);
    std::vector<V3d> all = disk.positions;
    all.insert(all.end(), counted.positions.begin(), counted.positions.end());
    const PointCloud kept = withoutOutliers(dense, {.deviations = 2}).cloud;
    all.insert(all.end(), kept.positions.begin(), kept.positions.end());
    all.emplace_back(spacing.mean, spacing.median, spacing.percentile95);
    return all;
  };
  const std::vector<V3d> one = support::onThreads(1, run);
  EXPECT_EQ(support::onThreads(7, run), one);
}

}  // namespace point_processing_test
