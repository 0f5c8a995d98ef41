// Meshes of segmented fields: closed surfaces, sharp junctions, measures.

#include "levelset/segmented/meshing/segmented_to_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "levelset/csg/csg.h"
#include "levelset/inspect/measure.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/measured.h"
#include "tests/support/segmented.h"

namespace segmented_to_mesh_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;
using support::interfaceDefects;
using support::InterfaceDefects;
using support::measured;
using support::measuredOrder;

double orderOf(double coarse, double fine) {
  return std::log2(coarse / fine);
}

/// Largest distance of the junctions of a cut ball from the true curves: the axis, and three arcs.
double sectorJunctionError(const SegmentedMesh& mesh, const support::Frame& frame) {
  double largest = 0;
  for (const JunctionEdge& edge : mesh.junctions)
    for (const std::uint32_t v : edge.vertices) {
      const V3d p = mesh.mesh.positions[v] - frame.centre;
      const double x = p.dot(frame.x), y = p.dot(frame.y);
      double distance = std::hypot(x, y);  // to the axis
      if (edge.labels[0] == kVoid) {
        distance = 1e9;
        for (int k = 0; k < 3; ++k) {
          // The half-planes between the sectors.
          const double angle = pi / 3 + 2 * pi / 3 * k,
                       along = x * std::cos(angle) + y * std::sin(angle),
                       off = y * std::cos(angle) - x * std::sin(angle);
          if (along > -0.1) distance = std::min(distance, std::hypot(off, p.length() - 1));
        }
      }
      largest = std::max(largest, distance);
    }
  return largest;
}

/// Measures the junctions of a ball of three sectors that is turned by an angle.
void expectJunctionsOfThreeSectors(double angle) {
  const support::Frame frame = support::turnedFrame(V3d(0.017, -0.023, 0.031), angle);
  std::vector<double> junction, length, volume, area, inner;
  for (const double voxel : {0.1, 0.05, 0.025}) {
    const SegmentedMesh mesh =
        segmentedToMesh(segmentSolids(support::ballSectors(frame, 1, voxel)).field);
    EXPECT_EQ(mesh.junctionPoints.size(), 2u);
    const SegmentedMeasurement m = measureSegmented(mesh);
    junction.push_back(sectorJunctionError(mesh, frame) / voxel);
    length.push_back(std::abs(m.junctionLength - (2 + 3 * pi)));
    volume.push_back(0);
    for (std::size_t k = 1; k < 4; ++k)
      volume.back() = std::max(volume.back(), std::abs(m.regions[k].volume - 4 * pi / 9));
    area.push_back(0);
    inner.push_back(0);
    ASSERT_EQ(m.interfaces.size(), 6u);
    for (const InterfaceMeasure& interface : m.interfaces) {
      const bool isOuter = interface.sides.front == kVoid;
      double& worst = isOuter ? area.back() : inner.back();
      worst = std::max(worst, std::abs(interface.area - (isOuter ? 4 * pi / 3 : pi / 2)));
    }
  }
  EXPECT_LT(junction[0], measured(0.0090));  // voxels
  EXPECT_LT(junction[1], measured(0.0027));
  EXPECT_LT(junction[2], measured(0.0014));
  EXPECT_LT(length[2], measured(3.9e-5));
  EXPECT_LT(inner[2], measured(5.3e-5));
  EXPECT_LT(volume[2], measured(4.6e-4));
  EXPECT_LT(area[2], measured(7.3e-4));
  EXPECT_GT(orderOf(volume[0], volume[2]) / 2, measuredOrder(1.94));
  EXPECT_GT(orderOf(area[0], area[2]) / 2, measuredOrder(1.9));
}

TEST(SegmentedToMesh, FindsJunctionsOfThreeSectors) {
  expectJunctionsOfThreeSectors(0.7);
}

TEST(SlowSegmentedToMesh, FindsJunctionsOfTurnedSectors) {
  expectJunctionsOfThreeSectors(2.1);
}

/// Two balls of radius 1, at this distance; the second one covers the first.
constexpr double kApart = 1;

struct LensErrors {
  double junction = 0, length = 0, volume = 0, area = 0;
};
LensErrors lensErrors(double voxel, const SegmentedMeshOptions& options) {
  const V3d first(0.013, 0.021, 0.037), axis(0.6, 0.48, 0.64);
  const std::vector<NarrowBand> balls = {makeSphere(1, first, voxel),
                                         makeSphere(1, first + axis * kApart, voxel)};
  const SegmentedMesh mesh = segmentedToMesh(segmentSolids(balls).field, options);
  const SegmentedMeasurement m = measureSegmented(mesh);
  const double ball = 4 * pi / 3, lens = pi * (4 + kApart) * std::pow(2 - kApart, 2) / 12,
               cap = 2 * pi * (1 - kApart / 2), radius = std::sqrt(1 - kApart * kApart / 4);
  LensErrors errors;
  errors.volume =
      std::max(std::abs(m.regions[1].volume - (ball - lens)), std::abs(m.regions[2].volume - ball));
  EXPECT_EQ(m.interfaces.size(), 3u);
  errors.area = std::max({std::abs(m.interfaces[0].area - (4 * pi - cap)),
                          std::abs(m.interfaces[1].area - (4 * pi - cap)),
                          std::abs(m.interfaces[2].area - cap)});
  errors.length = std::abs(m.junctionLength - 2 * pi * radius);
  for (const JunctionEdge& edge : mesh.junctions)
    for (const std::uint32_t v : edge.vertices) {
      const V3d p = mesh.mesh.positions[v] - first;
      const double along = p.dot(axis), across = (p - axis * along).length();
      errors.junction = std::max(errors.junction, std::hypot(along - kApart / 2, across - radius));
    }
  return errors;
}

TEST(SegmentedToMesh, MeasuresLensesOfBallsWithSecondOrder) {
  const LensErrors coarse = lensErrors(0.1, {}), middle = lensErrors(0.05, {}),
                   fine = lensErrors(0.025, {});
  EXPECT_LT(coarse.junction / 0.1, measured(0.0150));  // voxels
  EXPECT_LT(middle.junction / 0.05, measured(0.0034));
  EXPECT_LT(fine.junction / 0.025, measured(0.0014));
  EXPECT_LT(fine.volume, measured(1.29e-3));
  EXPECT_LT(fine.area, measured(1.52e-3));
  EXPECT_LT(fine.length, measured(2.8e-5));
  EXPECT_GT(orderOf(coarse.junction, fine.junction) / 2, measuredOrder(2.75));
  EXPECT_GT(orderOf(coarse.volume, fine.volume) / 2, measuredOrder(1.96));
  EXPECT_GT(orderOf(coarse.area, fine.area) / 2, measuredOrder(1.99));
  EXPECT_GT(orderOf(coarse.length, fine.length) / 2, measuredOrder(3.1));
  // Junctions without fits are off by a fraction of a voxel.
  EXPECT_LT(lensErrors(0.05, {.sharpensJunctions = false}).junction / 0.05, measured(0.751));
}

/// Tests the meshes of random partitions.
/// @return largest relative difference of their volume and that of the union, of every tenth one
double worstOfRandomPartitions(int count) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  constexpr double kVoxel = 0.15;
  double worst = 0;
  for (int n = 0; n < count; ++n) {
    std::vector<NarrowBand> solids;
    for (int k = 0; k < 5; ++k) {
      const V3d centre(1.2 * unit(random), 1.2 * unit(random), 1.2 * unit(random));
      if (random() % 2)
        solids.push_back(makeSphere(0.3 + 0.4 * unit(random), centre, kVoxel));
      else
        solids.push_back(makeBox(
            V3d(0.4 + 0.6 * unit(random), 0.4 + 0.6 * unit(random), 0.4 + 0.6 * unit(random)),
            centre, kVoxel));
    }
    const SegmentSolidsResult result = segmentSolids(solids);
    const SegmentedMesh mesh = segmentedToMesh(result.field);
    EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects()) << n;
    // The regions together are the complement of the void.
    const SegmentedMeasurement m = measureSegmented(mesh);
    EXPECT_NEAR(m.volume, -signedVolume(regionSurface(mesh, kVoid)), 1e-12);
    for (std::size_t k = 1; k < m.regions.size(); ++k) EXPECT_GT(m.regions[k].volume, 0);
    if (n % 10 != 0) continue;
    const double whole = measure(combine(CsgOperation::Union, solids).band).volume;
    worst = std::max(worst, std::abs(m.volume - whole) / whole);
  }
  return worst;
}

TEST(SegmentedToMesh, ClosesTheSurfacesOfRandomPartitions) {
  EXPECT_LT(worstOfRandomPartitions(30), measured(0.0445));
}

TEST(SlowSegmentedToMesh, ClosesTheSurfacesOfManyRandomPartitions) {
  EXPECT_LT(worstOfRandomPartitions(100), measured(0.0445));
}

TEST(SegmentedToMesh, SharesTheWallsOfBoxes) {
  // Faces on grid points, where all distances are equal, and between them.
  for (const V3d& origin : {V3d(0), V3d(0.031, 0.017, 0.023)}) {
    std::vector<double> volume, area, length;
    for (const double voxel : {0.1, 0.05}) {
      const std::vector<NarrowBand> boxes = {
          makeBox(V3d(1), origin + V3d(0.5), voxel),
          makeBox(V3d(1), origin + V3d(1.5, 0.5, 0.5), voxel),
          makeBox(V3d(2, 1, 1), origin + V3d(1, 1.5, 0.5), voxel)};
      const SegmentedMesh mesh = segmentedToMesh(segmentSolids(boxes).field);
      EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
      EXPECT_EQ(mesh.junctionPoints.size(), 2u);
      const SegmentedMeasurement m = measureSegmented(mesh);
      ASSERT_EQ(m.interfaces.size(), 6u);
      volume.push_back(std::abs(m.volume - 4));
      length.push_back(std::abs(m.junctionLength - 10));
      area.push_back(0);
      const std::array<double, 6> exact = {4, 4, 8, 1, 1, 1};
      for (std::size_t k = 0; k < 6; ++k)
        area.back() = std::max(area.back(), std::abs(m.interfaces[k].area - exact[k]));
    }
    // The edges of the boxes are cut off, as by any mesh of cubes.
    EXPECT_LT(volume[1], measured(0.0130));
    EXPECT_LT(area[1], measured(0.140));
    EXPECT_LT(length[1], measured(0.346));
    EXPECT_GT(orderOf(volume[0], volume[1]), measuredOrder(2.05));
  }
}

TEST(SegmentedToMesh, MeshesABallInTwoHalvesInsideABox) {
  constexpr double kVoxel = 0.05;
  const support::Frame frame = support::turnedFrame(V3d(0.02, 0.01, 0.03), 1);
  const auto half = [&](double sign) {
    return support::sampleBand(
        [&, sign](const V3d& p) {
          return std::max(sign * (p - frame.centre).dot(frame.x), (p - frame.centre).length() - 1);
        },
        {frame.centre - V3d(1), frame.centre + V3d(1)}, kVoxel);
  };
  const std::vector<NarrowBand> solids = {makeBox(V3d(3), V3d(0), kVoxel), half(1), half(-1)};
  const SegmentedMesh mesh = segmentedToMesh(segmentSolids(solids).field);
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  const SegmentedMeasurement m = measureSegmented(mesh);
  ASSERT_EQ(m.interfaces.size(), 4u);  // void and box, box and halves, both halves
  EXPECT_NEAR(m.regions[2].volume, 2 * pi / 3, measured(2.6e-3));
  EXPECT_NEAR(m.interfaces[1].area, 2 * pi, measured(3.9e-3));
  EXPECT_NEAR(m.interfaces[3].area, pi, measured(1.4e-4));
  EXPECT_NEAR(m.junctionLength, 2 * pi, measured(1.5e-4));
}

TEST(SegmentedToMesh, MeshesLayers) {
  std::vector<NarrowBand> balls;
  for (const double radius : {1.0, 0.8, 0.5, 0.3})
    balls.push_back(makeSphere(radius, V3d(0.01), 0.05));
  const SegmentedMesh mesh = segmentedToMesh(segmentSolids(balls).field);
  EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
  EXPECT_TRUE(mesh.junctions.empty());
  const SegmentedMeasurement m = measureSegmented(mesh);
  ASSERT_EQ(m.interfaces.size(), 4u);
  EXPECT_NEAR(m.volume, 4 * pi / 3, measured(5.3e-3));
  EXPECT_NEAR(m.regions[2].volume, 4 * pi / 3 * (0.512 - 0.125), measured(1.6e-3));
}

TEST(SegmentedToMesh, MeshesOneRegionAlone) {
  const support::Frame frame = support::turnedFrame(V3d(0.017, -0.023, 0.031), 0.7);
  std::vector<NarrowBand> solids = support::ballSectors(frame, 1, 0.05);
  solids.push_back(makeSphere(0.3, V3d(0.5, 0.4, 0.3), 0.05));
  const SegmentedField field = segmentSolids(solids).field;
  const SegmentedMesh mesh = segmentedToMesh(field);
  for (RegionLabel region = 0; region < 5; ++region) {
    const TriMesh one = regionSurface(field, region), other = regionSurface(mesh, region);
    EXPECT_EQ(one.triangles, other.triangles);
    EXPECT_EQ(one.positions, other.positions);
    EXPECT_EQ(manifoldness(one).boundaryEdges, 0u);
  }
}

TEST(SegmentedToMesh, IsEmptyForAnEmptyField) {
  EXPECT_TRUE(segmentedToMesh(SegmentedField()).mesh.isEmpty());
  const SegmentedMeasurement m = measureSegmented(SegmentedField());
  EXPECT_EQ(m.volume, 0);
  EXPECT_EQ(m.regions.size(), 1u);
}

}  // namespace segmented_to_mesh_test
