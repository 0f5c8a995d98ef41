#include "levelset/meshing/band_to_mesh.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <openvdb/tools/ChangeBackground.h>
#include <limits>

#include <random>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "tests/support/bands.h"

namespace band_to_mesh_test {

using namespace levelset;
using Imath::V3d;

Imath::Box3d cube(double half) {
  return {V3d(-half), V3d(half)};
}

NarrowBand sphere(double radius, double voxelSize, const V3d& centre = V3d(0)) {
  return support::sampleBand([=](const V3d& p) { return (p - centre).length() - radius; },
                             {centre - V3d(radius), centre + V3d(radius)}, voxelSize);
}

/// Random values, hence all 256 patterns of signs, with zeros on grid points and the rest near
/// them.
NarrowBand noise(int size, unsigned seed, bool withZeros) {
  auto grid = emptyLevelSet(uniformTransform(1), 3);
  std::mt19937 random(seed);
  openvdb::Coord c;
  for (c[0] = 0; c[0] < size; ++c[0])
    for (c[1] = 0; c[1] < size; ++c[1])
      for (c[2] = 0; c[2] < size; ++c[2]) {
        const auto draw = random() % 8;
        float value = (static_cast<float>(random() % 2001) - 1000) * 1e-3f;
        if (withZeros && draw == 0) value = 0;
        if (withZeros && draw == 1) value = -1e-30f;
        if (withZeros && draw == 2) value = 1e-30f;
        grid->tree().setValueOn(c, value);
      }
  return makeBand(grid);
}

double smallestArea(const TriMesh& mesh) {
  double smallest = std::numeric_limits<double>::max();
  for (const auto& t : mesh.triangles) {
    const V3d ab = mesh.positions[t[1]] - mesh.positions[t[0]];
    const V3d ac = mesh.positions[t[2]] - mesh.positions[t[0]];
    smallest = std::min(smallest, ab.cross(ac).length() / 2);
  }
  return smallest;
}

template <typename F>
void withThreads(std::size_t count, const F& run) {
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, count);
  run();
}

TEST(BandToMesh, PutsVerticesOnSphere) {
  const double h = 1. / 32;
  const V3d centre(0.3 * h, 0.1 * h, -0.4 * h);
  const TriMesh mesh = bandToMesh(sphere(1, h, centre));
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  double worst = 0;
  for (const V3d& p : mesh.positions) worst = std::max(worst, std::abs((p - centre).length() - 1));
  EXPECT_LT(worst, h * h / 8);  // linear interpolation along an edge: h²/8 × the curvature
  EXPECT_GT(signedVolume(mesh), 0);
}

TEST(BandToMesh, IsClosedManifoldForEveryPatternOfSigns) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const TriMesh mesh = bandToMesh(noise(26, seed, seed % 2 == 1));
    const Manifoldness found = manifoldness(mesh);
    EXPECT_EQ(found.boundaryEdges, 0u);
    EXPECT_EQ(found.nonManifoldEdges, 0u);
    EXPECT_EQ(found.misorientedEdges, 0u);
    EXPECT_EQ(found.nonManifoldVertices, 0u);
    EXPECT_GT(smallestArea(mesh), 0);
    EXPECT_GT(signedVolume(mesh), 0);
  }
}

TEST(BandToMesh, KeepsPlanesThroughGridPointsExact) {
  // A box whose faces lie on grid planes: zeros are outside.
  const auto box = [](const V3d& p) {
    const V3d q(std::abs(p.x) - 4, std::abs(p.y) - 4, std::abs(p.z) - 4);
    const V3d outer(std::max(q.x, 0.), std::max(q.y, 0.), std::max(q.z, 0.));
    return outer.length() + std::min(std::max({q.x, q.y, q.z}), 0.);
  };
  const TriMesh mesh = bandToMesh(support::sampleBand(box, cube(4), 1));
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  const Imath::Box3d found = bounds(mesh);
  EXPECT_EQ(found.min, V3d(-4));
  EXPECT_EQ(found.max, V3d(4));
}

TEST(BandToMesh, ClosesThinSheetsAndSingleVoxels) {
  // Thinner than a voxel: two crossings on one edge cannot be seen, one grid layer can.
  const auto sheet = [](const V3d& p) {
    return std::max({std::abs(p.x) - 0.3, std::abs(p.y) - 9.5, std::abs(p.z) - 9.5});
  };
  EXPECT_TRUE(manifoldness(bandToMesh(support::sampleBand(sheet, cube(10), 1))).isClosedManifold());
  auto grid = emptyLevelSet(uniformTransform(1), 3);
  grid->tree().setValueOn(openvdb::Coord(8, 8, 8), -0.5f);  // lowest corner of a leaf
  const TriMesh voxel = bandToMesh(makeBand(grid));
  EXPECT_TRUE(manifoldness(voxel).isClosedManifold());
  EXPECT_EQ(voxel.triangles.size(), 8u);
}

TEST(BandToMesh, ClosesBandsThatWereCutOpen) {
  // Inactive values and tiles count with their sign, so a cut gets a lid.
  const NarrowBand whole = sphere(20, 1);
  auto grid = vdb(whole).deepCopy();
  grid->fill(openvdb::CoordBBox(openvdb::Coord(-40, -40, 5), openvdb::Coord(40, 40, 40)),
             grid->background(), false);
  grid->pruneGrid();
  EXPECT_TRUE(manifoldness(bandToMesh(makeBand(grid))).isClosedManifold());
  auto tiles = emptyLevelSet(uniformTransform(1), 3);
  tiles->fill(openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(31)), -3.f, false);
  tiles->fill(openvdb::CoordBBox(openvdb::Coord(128), openvdb::Coord(255)), -3.f, false);
  tiles->tree().setValueOn(openvdb::Coord(-100), 2.f);
  const TriMesh mesh = bandToMesh(makeBand(tiles));
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  EXPECT_NEAR(signedVolume(mesh), 32. * 32 * 32 + 128. * 128 * 128, 0.01 * 128 * 128 * 128);
}

TEST(BandToMesh, HoldsFarFromOriginAndRotated) {
  const auto rotated = [](const V3d& shift) {
    Imath::M44d m;
    m.setScale(0.01);
    m.rotate(V3d(0.4, 0.7, -0.2));
    openvdb::math::Mat4d matrix;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) matrix[i][j] = m[i][j];
    for (int j = 0; j < 3; ++j) matrix[3][j] = shift[j];
    auto grid = vdb(sphere(20, 1)).deepCopy();
    for (auto it = grid->beginValueAll(); it; ++it) it.setValue(*it * 0.01f);
    openvdb::tools::changeBackground(grid->tree(), 0.03f);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
    return bandToMesh(makeBand(grid));
  };
  const TriMesh near = rotated(V3d(0)), far = rotated(V3d(1e6, -1e6, 1e6));
  ASSERT_EQ(near.triangles, far.triangles);
  EXPECT_TRUE(manifoldness(far).isClosedManifold());
  for (std::size_t i = 0; i < near.positions.size(); ++i) {
    EXPECT_NEAR((far.positions[i] - V3d(1e6, -1e6, 1e6) - near.positions[i]).length(), 0, 1e-9);
    EXPECT_NEAR(near.positions[i].length(), 0.2, 0.01 * 0.01);
  }
}

TEST(BandToMesh, GivesSameBitsForAnyNumberOfThreads) {
  const NarrowBand band = noise(40, 7, true);
  TriMesh one;
  withThreads(1, [&] { one = bandToMesh(band); });
  for (const std::size_t threads : {2u, 4u}) {
    withThreads(threads, [&] {
      const TriMesh other = bandToMesh(band);
      EXPECT_EQ(one.positions, other.positions);
      EXPECT_EQ(one.triangles, other.triangles);
    });
  }
}

/// Distance to a cube of that half edge; a turned copy of it is what grids find hard.
double cubeDistance(const V3d& p, double half) {
  const V3d q(std::abs(p.x) - half, std::abs(p.y) - half, std::abs(p.z) - half);
  const V3d outer(std::max(q.x, 0.), std::max(q.y, 0.), std::max(q.z, 0.));
  return outer.length() + std::min(std::max({q.x, q.y, q.z}), 0.);
}

Imath::M44d turned() {
  Imath::M44d m;
  m.rotate(V3d(0.4, 0.7, -0.2));
  return m;
}

struct CubeError {
  double vertices = 0;      ///< largest distance of a vertex from the cube
  double farTriangles = 0;  ///< share of triangles whose middle or sides pass 0.05 voxel from it
};

CubeError cubeError(const TriMesh& mesh, const Imath::M44d& back, double half) {
  CubeError error;
  std::vector<V3d> local;
  for (const V3d& p : mesh.positions) {
    local.push_back(p * back);
    error.vertices = std::max(error.vertices, std::abs(cubeDistance(local.back(), half)));
  }
  double far = 0;
  for (const auto& t : mesh.triangles) {
    const V3d a = local[t[0]], b = local[t[1]], c = local[t[2]];
    double worst = 0;
    for (const V3d& p : {(a + b + c) / 3., (a + b) / 2., (b + c) / 2., (c + a) / 2.}) {
      worst = std::max(worst, std::abs(cubeDistance(p, half)));
    }
    far += worst > 0.05;
  }
  error.farTriangles = far / static_cast<double>(mesh.triangles.size());
  return error;
}

TEST(BandToMesh, SharpKeepsEdgesOfTurnedCube) {
  const Imath::M44d matrix = turned(), back = matrix.inverse();
  for (const double half : {16.0, 32.13}) {
    const NarrowBand band = support::sampleBand(
        [&](const V3d& p) { return cubeDistance(p * back, half); }, cube(half * 1.6), 1);
    const TriMesh mesh = bandToMesh(band, {.sharp = true}), uniform = bandToMesh(band);
    EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
    const CubeError sharp = cubeError(mesh, back, half), cut = cubeError(uniform, back, half);
    EXPECT_LT(sharp.vertices, 0.05);
    EXPECT_LT(sharp.farTriangles, 0.02 * cut.farTriangles);
    const double exact = 8 * half * half * half;
    EXPECT_LT(std::abs(signedVolume(mesh) - exact), 0.04 * std::abs(signedVolume(uniform) - exact));
  }
}

TEST(BandToMesh, AdaptiveCoarsensFlatPartsWithinBound) {
  const double adaptivity = 0.2;
  const NarrowBand box =
      support::sampleBand([](const V3d& p) { return cubeDistance(p, 12.3); }, cube(13), 1);
  const TriMesh coarseBox = bandToMesh(box, {.adaptivity = adaptivity});
  EXPECT_TRUE(manifoldness(coarseBox).isClosedManifold());
  EXPECT_LT(coarseBox.triangles.size() * 10, bandToMesh(box).triangles.size());
  const NarrowBand ball = sphere(12.2, 1);
  const TriMesh coarseBall = bandToMesh(ball, {.adaptivity = adaptivity});
  EXPECT_TRUE(manifoldness(coarseBall).isClosedManifold());
  EXPECT_LT(coarseBall.triangles.size() * 3 / 2, bandToMesh(ball).triangles.size());
  for (const auto& t : coarseBall.triangles) {
    const V3d sum =
        coarseBall.positions[t[0]] + coarseBall.positions[t[1]] + coarseBall.positions[t[2]];
    EXPECT_NEAR(sum.length() / 3, 12.2, adaptivity + 0.02);
  }
  const TriMesh rough = bandToMesh(noise(10, 3, true), {.adaptivity = 1});
  EXPECT_TRUE(manifoldness(rough).isClosedManifold());
}

TEST(BandToMesh, SharpIsAsExactOnSphere) {
  const double h = 1. / 32;
  const TriMesh mesh = bandToMesh(sphere(1, h, V3d(0.3 * h, 0.1 * h, -0.4 * h)), {.sharp = true});
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  double worst = 0;
  for (const V3d& p : mesh.positions) {
    worst = std::max(worst, std::abs((p - V3d(0.3 * h, 0.1 * h, -0.4 * h)).length() - 1));
  }
  EXPECT_LT(worst, 2 * h * h / 8);
}

TEST(BandToMesh, SharpIsClosedManifoldForEveryPatternOfSigns) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const NarrowBand band = noise(26, seed, seed % 2 == 1);
    TriMesh mesh;
    withThreads(1, [&] { mesh = bandToMesh(band, {.sharp = true}); });
    const Manifoldness found = manifoldness(mesh);
    EXPECT_EQ(found.boundaryEdges, 0u);
    EXPECT_EQ(found.nonManifoldEdges, 0u);
    EXPECT_EQ(found.misorientedEdges, 0u);
    EXPECT_EQ(found.nonManifoldVertices, 0u);
    withThreads(4, [&] {
      const TriMesh other = bandToMesh(band, {.sharp = true});
      EXPECT_EQ(mesh.positions, other.positions);
      EXPECT_EQ(mesh.triangles, other.triangles);
    });
  }
}

TEST(BandToMesh, RefusesWhatItCannotMesh) {
  const NarrowBand band = sphere(5, 1);
  EXPECT_THROW((void)bandToMesh(NarrowBand()), InvalidInput);
  EXPECT_THROW((void)bandToMesh(makeBand(emptyLevelSet(uniformTransform(1), 3))), InvalidInput);
  auto outside = emptyLevelSet(uniformTransform(1), 3);
  outside->tree().setValueOn(openvdb::Coord(0), 1.f);
  EXPECT_THROW((void)bandToMesh(makeBand(outside)), InvalidInput);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double adaptivity : {-0.1, 1.1, nan}) {
    EXPECT_THROW((void)bandToMesh(band, {.adaptivity = adaptivity}), UsageError);
  }
  EXPECT_THROW((void)bandToMesh(band, {.adaptivity = 0.5, .sharp = true}), UsageError);
  EXPECT_THROW((void)bandToMesh(band, {.progress = [](double) { return false; }}), Cancelled);
}

}  // namespace band_to_mesh_test
