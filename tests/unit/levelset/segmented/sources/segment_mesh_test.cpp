// Segmented fields of meshes whose triangles separate several regions.

#include "levelset/segmented/sources/segment_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "levelset/error.h"
#include "levelset/segmented/meshing/measure_segmented.h"
#include "levelset/segmented/segment_solids.h"
#include "tests/support/measured.h"
#include "tests/support/segmented.h"
#include "tests/support/threads.h"

namespace segment_mesh_test {

using namespace levelset;
using Imath::V3d;
using std::numbers::pi;
using support::interfaceDefects;
using support::InterfaceDefects;
using support::measured;
using support::measuredOrder;

/// Sphere with a diaphragm in its equator.
TriMesh sphereWithDiaphragm(const V3d& centre) {
  constexpr unsigned kRings = 24, kSides = 2 * kRings;
  TriMesh mesh = support::sphereMesh(1, centre, kRings);
  const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.push_back(centre);
  const auto equator = [](unsigned j) { return 1 + (kRings / 2 - 1) * kSides + j % kSides; };
  for (unsigned j = 0; j < kSides; ++j)
    mesh.triangles.push_back({middle, equator(j), equator(j + 1)});
  return mesh;
}

/// Boxes one beside the other; the walls between them are there twice.
TriMesh boxWithWalls(const V3d& origin) {
  TriMesh mesh;
  double from = 0;
  for (const double to : {1.0, 1.7, 3.0}) {
    mesh =
        support::joined(mesh, support::boxMesh(origin + V3d(from, 0, 0), origin + V3d(to, 1, 1)));
    from = to;
  }
  return mesh;
}

TEST(SegmentMesh, FindsTheHalvesOfASphereWithADiaphragm) {
  // The diaphragm passes between grid points, and through them.
  for (const V3d& centre : {V3d(0.013, 0.021, 0.037), V3d(0)}) {
    const TriMesh mesh = sphereWithDiaphragm(centre);
    const SegmentMeshResult result = segmentMesh(mesh, 0.05);
    EXPECT_EQ(result.patches, 3u);
    EXPECT_EQ(result.field.labels(), (std::vector<RegionLabel>{1, 2}));
    const SegmentedMesh segmented = segmentedToMesh(result.field);
    EXPECT_EQ(interfaceDefects(segmented), InterfaceDefects());
    const SegmentedMeasurement m = measureSegmented(segmented);
    ASSERT_EQ(m.interfaces.size(), 3u);
    EXPECT_NEAR(m.volume, signedVolume(support::sphereMesh(1, centre, 24)), measured(5.3e-3));
    EXPECT_NEAR(m.regions[1].volume, m.regions[2].volume, measured(1.4e-4));
    EXPECT_NEAR(m.interfaces[2].area, pi, measured(0.0131));
    EXPECT_NEAR(m.junctionLength, 2 * pi, measured(0.0224));
  }
}

TEST(SegmentMesh, FindsTheRoomsOfABoxWithWalls) {
  for (const V3d& origin : {V3d(0), V3d(0.031, 0.017, 0.023)})
    for (const double voxel : {0.1, 0.073, 0.05}) {
      const SegmentMeshResult result = segmentMesh(boxWithWalls(origin), voxel);
      EXPECT_EQ(result.field.labels(), (std::vector<RegionLabel>{1, 2, 3}));
      // By decreasing volume.
      const SegmentedSampler sampler(result.field);
      EXPECT_EQ(sampler.label(origin + V3d(2.5, 0.5, 0.5)), 1);
      EXPECT_EQ(sampler.label(origin + V3d(0.5, 0.5, 0.5)), 2);
      EXPECT_EQ(sampler.label(origin + V3d(1.3, 0.5, 0.5)), 3);
      EXPECT_EQ(sampler.label(origin + V3d(1.3, 0.5, 1.5)), kVoid);
      const SegmentedMesh mesh = segmentedToMesh(result.field);
      EXPECT_EQ(interfaceDefects(mesh), InterfaceDefects());
      const SegmentedMeasurement m = measureSegmented(mesh);
      EXPECT_NEAR(m.regions[1].volume, 1.3, measured(0.0230) * voxel * voxel / 0.01);
    }
}

TEST(SegmentMesh, NamesRoomsThatAreThinnerThanAVoxel) {
  const auto rooms = [](double from, double to) {
    const V3d low(0, 0.03, 0.03), size(1);
    TriMesh mesh;
    for (const auto& [a, b] : {std::pair{0.0, from}, {from, to}, {to, 2.0}})
      mesh = support::joined(mesh, support::boxMesh(low + V3d(a, 0, 0), low + V3d(b, 1, 1)));
    return segmentMesh(mesh, 0.1).field;
  };
  const SegmentedField field = rooms(0.97, 1.03);
  const std::vector<ThinPart> thin = thinParts(field);
  EXPECT_EQ(field.labels(), (std::vector<RegionLabel>{1, 2, 3}));
  ASSERT_EQ(thin.size(), 1u);
  EXPECT_EQ(thin[0].label, 3);
  EXPECT_EQ(thin[0].places, 100u);
  EXPECT_NEAR(thin[0].thickness, 0.06, 0.025);
  EXPECT_NEAR(thin[0].position.x, 1, 0.015);
  EXPECT_TRUE(thinParts(rooms(0.85, 1.15)).empty());
}

TEST(SegmentMesh, RepeatsAPartitionWithSecondOrder) {
  const support::Frame frame = support::turnedFrame(V3d(0.017, -0.023, 0.031), 0.7);
  const SegmentedMesh given =
      segmentedToMesh(segmentSolids(support::ballSectors(frame, 1, 0.04)).field);
  const SegmentedMeasurement exact = measureSegmented(given);
  const auto errorOf = [&](double voxel) {
    const SegmentMeshResult result = segmentMesh(given.mesh, voxel);
    EXPECT_EQ(result.patches, 6u);
    EXPECT_EQ(result.field.labels().size(), 3u);
    return std::abs(measureSegmented(result.field).volume - exact.volume);
  };
  const double coarse = errorOf(0.1), fine = errorOf(0.05);
  EXPECT_LT(fine, measured(5.0e-3));
  EXPECT_GT(std::log2(coarse / fine), measuredOrder(1.92));
}

TEST(SegmentMesh, HasTheSameBitsWithAnyNumberOfThreads) {
  const TriMesh mesh = sphereWithDiaphragm(V3d(0.01));
  const auto run = [&](std::size_t threads) {
    return support::onThreads(threads, [&] { return segmentMesh(mesh, 0.1).field.contentHash(); });
  };
  EXPECT_EQ(run(1), run(4));
}

TEST(SegmentMesh, Refuses) {
  const TriMesh mesh = sphereWithDiaphragm(V3d(0));
  EXPECT_THROW((void)segmentMesh(TriMesh(), 0.1), InvalidInput);
  EXPECT_THROW((void)segmentMesh(support::sphereMesh(1, V3d(0), 24, 0.8), 0.1), InvalidInput);
  // A diaphragm with a hole.
  TriMesh torn = mesh;
  torn.triangles.resize(torn.triangles.size() - 12);
  EXPECT_THROW((void)segmentMesh(torn, 0.1), InvalidInput);
  EXPECT_THROW((void)segmentMesh(mesh, 10), InvalidInput);
  EXPECT_THROW((void)segmentMesh(mesh, 0), UsageError);
  EXPECT_THROW((void)segmentMesh(mesh, 0.1, {.halfWidth = 1}), UsageError);
  EXPECT_THROW((void)segmentMesh(mesh, 0.1, {.maxMemory = 1000}), ResourceLimit);
  EXPECT_THROW((void)segmentMesh(mesh, 0.1, {.progress = [](double) { return false; }}), Cancelled);
}

}  // namespace segment_mesh_test
