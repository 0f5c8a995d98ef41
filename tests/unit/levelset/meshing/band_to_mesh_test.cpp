#include "levelset/meshing/band_to_mesh.h"

#include <gtest/gtest.h>

#include <openvdb/tools/ChangeBackground.h>
#include <limits>

#include <random>

#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/rounded_solids.h"
#include "tests/support/threads.h"

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

/// Random values, so that all 256 sign patterns occur. Some zeros lie on grid points, the others
/// near them.
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
  // A box with faces on grid planes. Zeros count as outside.
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
  // Thinner than a voxel. Two crossings on one edge are not resolved, a single grid layer is.
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

TEST(BandToMesh, ClosesTruncatedBands) {
  // Inactive values and tiles count with their sign, so that a cut is closed.
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
  EXPECT_NEAR(signedVolume(mesh), 32. * 32 * 32 + 128. * 128 * 128,
              support::measured(1.14e-4) * 128 * 128 * 128);
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
    EXPECT_NEAR((far.positions[i] - V3d(1e6, -1e6, 1e6) - near.positions[i]).length(), 0,
                support::measured(9.7e-11));
    EXPECT_NEAR(near.positions[i].length(), 0.2, support::measured(0.00594) * 0.01);
  }
}

TEST(BandToMesh, GivesSameBitsForAnyNumberOfThreads) {
  const NarrowBand band = noise(40, 7, true);
  TriMesh one;
  support::onThreads(1, [&] { one = bandToMesh(band); });
  for (const std::size_t threads : {2u, 4u}) {
    support::onThreads(threads, [&] {
      const TriMesh other = bandToMesh(band);
      EXPECT_EQ(one.positions, other.positions);
      EXPECT_EQ(one.triangles, other.triangles);
    });
  }
}

/// Distance to a cube with half edge `half`. A rotated copy of it is difficult for grids.
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

/// Largest distance of points of a triangle mesh from the cube, with four samples along each side.
double meshToCube(const TriMesh& mesh, const Imath::M44d& back, double half) {
  double worst = 0;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i <= 4; ++i) {
      for (int j = 0; i + j <= 4; ++j) {
        const V3d p = (mesh.positions[t[0]] * i + mesh.positions[t[1]] * j +
                       mesh.positions[t[2]] * (4 - i - j)) /
                      4.0;
        worst = std::max(worst, std::abs(cubeDistance(p * back, half)));
      }
    }
  }
  return worst;
}

double triangleDistance(const V3d& p, const V3d& a, const V3d& b, const V3d& c) {
  const V3d normal = (b - a).cross(c - a);
  bool isOver = true;
  double nearest = std::numeric_limits<double>::max();
  for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
    isOver &= normal.cross(to - from).dot(p - from) >= 0;
    const double t = std::clamp((p - from).dot(to - from) / (to - from).length2(), 0.0, 1.0);
    nearest = std::min(nearest, (p - from - (to - from) * t).length());
  }
  return isOver ? std::abs(normal.dot(p - a)) / normal.length() : nearest;
}

/// Largest distance from the mesh of points on the cube's edges, corners included.
double cubeEdgesToMesh(const TriMesh& mesh, const Imath::M44d& back, double half) {
  std::vector<std::array<V3d, 3>> beside;  // triangles near an edge, in the cube's frame
  for (const auto& t : mesh.triangles) {
    const std::array<V3d, 3> corners = {mesh.positions[t[0]] * back, mesh.positions[t[1]] * back,
                                        mesh.positions[t[2]] * back};
    int near = 0;
    for (int axis = 0; axis < 3; ++axis) near += std::abs(corners[0][axis]) > half - 2;
    if (near > 1) beside.push_back(corners);
  }
  double worst = 0;
  const int steps = static_cast<int>(std::ceil(2 * half / 0.4));
  for (int edge = 0; edge < 12; ++edge) {
    const int axis = edge / 4;
    V3d p((edge & 1) ? half : -half);
    p[(axis + 1) % 3] = (edge & 2) ? half : -half;
    for (int i = 0; i <= steps; ++i) {
      p[axis] = half * (2.0 * i / steps - 1);
      double nearest = std::numeric_limits<double>::max();
      for (const auto& t : beside) {
        if ((t[0] - p).length2() > 9) continue;
        nearest = std::min(nearest, triangleDistance(p, t[0], t[1], t[2]));
      }
      worst = std::max(worst, nearest);
    }
  }
  return worst;
}

/// Area of the triangles whose normal deviates by more than 60° from the cube's face below them.
double foldedArea(const TriMesh& mesh, const Imath::M44d& back) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const V3d a = mesh.positions[t[0]] * back, b = mesh.positions[t[1]] * back,
              c = mesh.positions[t[2]] * back;
    const V3d middle = (a + b + c) / 3.0, twice = (b - a).cross(c - a);
    int axis = 0;
    for (int i = 1; i < 3; ++i)
      if (std::abs(middle[i]) > std::abs(middle[axis])) axis = i;
    if (twice[axis] * (middle[axis] > 0 ? 1 : -1) < 0.5 * twice.length()) sum += twice.length() / 2;
  }
  return sum;
}

TEST(BandToMesh, SharpKeepsEdgesAndCornersOfRotatedCubes) {
  std::mt19937 random(11);
  const auto draw = [&] { return static_cast<double>(random() % 2001) / 1000 - 1; };
  for (int turn = 0; turn < 8; ++turn) {
    const double half = 10 + draw();
    Imath::M44d matrix;
    matrix.rotate(V3d(3 * draw(), 3 * draw(), 3 * draw()));
    const V3d phase(draw(), draw(), draw());
    for (int axis = 0; axis < 3; ++axis) matrix[3][axis] = phase[axis];
    const Imath::M44d back = matrix.inverse();
    const NarrowBand band = support::sampleBand(
        [&](const V3d& p) { return cubeDistance(p * back, half); }, cube(half * 1.8), 1);
    const TriMesh mesh = bandToMesh(band, {.sharp = true});
    EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
    EXPECT_LT(meshToCube(mesh, back, half), support::measured(0.0355, 0.05)) << turn;
    EXPECT_LT(cubeEdgesToMesh(mesh, back, half), support::measured(0.0472, 0.05)) << turn;
    EXPECT_LT(foldedArea(mesh, back), support::rounding(1)) << turn;
    const double exact = 8 * half * half * half;
    EXPECT_NEAR(signedVolume(mesh), exact, support::measured(1.38e-6) * exact);
  }
}

TEST(BandToMesh, SharpKeepsConcaveEdges) {
  // A cube without one of its octants: nine faces and three concave edges.
  const Imath::M44d matrix = turned(), back = matrix.inverse();
  const double half = 15.3;
  const auto box = [&](const V3d& centre) {
    return support::sampleBand([=](const V3d& p) { return cubeDistance(p * back - centre, half); },
                               {V3d(-1.8 * half), V3d(3.6 * half)}, 1);
  };
  const NarrowBand band = subtract(box(V3d(0)), box(V3d(half)));
  const TriMesh mesh = bandToMesh(band, {.sharp = true}), uniform = bandToMesh(band);
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  const double exact = 7 * half * half * half;
  EXPECT_NEAR(signedVolume(mesh), exact, support::rounding(3) * exact);
  EXPECT_GT(std::abs(signedVolume(uniform) - exact), 1e-4 * exact);
}

TEST(BandToMesh, SharpKeepsAWedge) {
  // Two faces meet at 40° along the tip of a long prism.
  const Imath::M44d matrix = turned(), back = matrix.inverse();
  const double slope = 20 * std::acos(-1.0) / 180, length = 14, depth = 9;
  const auto planes = [=](const V3d& p) {
    const V3d q = p * back;
    return std::max({std::abs(q.y) * std::cos(slope) + (q.x - length) * std::sin(slope),
                     -q.x - length, std::abs(q.z) - depth});
  };
  const TriMesh mesh = bandToMesh(support::sampleBand(planes, cube(24), 1), {.sharp = true});
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  double worst = 0;
  for (const V3d& p : mesh.positions) worst = std::max(worst, std::abs(planes(p)));
  EXPECT_LT(worst, support::measured(0.00814));
  // The volume lacks the parts between the vertices and the exact edge.
  const double exact = 4 * length * length * std::tan(slope) * 2 * depth;
  EXPECT_NEAR(signedVolume(mesh), exact, support::measured(7.23e-6) * exact);
}

TEST(BandToMesh, SharpKeepsRoundSolidsRound) {
  for (const double radius : {3.0, 4.0, 5.0, 6.0, 8.0, 20.0}) {
    for (const V3d& centre : {V3d(0), V3d(0.3, 0.1, -0.4), V3d(0.5, 0.25, 0.1)}) {
      const TriMesh mesh = bandToMesh(sphere(radius, 1, centre), {.sharp = true});
      EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
      double worst = 0;
      for (const V3d& p : mesh.positions)
        worst = std::max(worst, std::abs((p - centre).length() - radius));
      EXPECT_LT(worst, support::measured(0.0218)) << radius << centre;
    }
  }
}

TEST(BandToMesh, SharpLeavesRoundedEdgesRound) {
  for (const support::RoundedSolid& solid : support::roundedSolids()) {
    const TriMesh mesh = bandToMesh(solid.band(), {.sharp = true});
    double worst = 0;
    for (const V3d& p : mesh.positions) worst = std::max(worst, std::abs(solid.distance(p)));
    // At an edge of a box rounded by a voxel a sharp vertex would be off by 0.41, at a corner by
    // 0.73.
    EXPECT_LT(worst, support::measured(0.107)) << solid.name;
  }
}

// The round faces are no planes, and vertices near the edge are easily put in the wrong order.
TEST(BandToMesh, SharpKeepsTheRimsOfCylinders) {
  for (const double radius : {12.7, 15.2, 20.0}) {
    const auto cylinder = [=](const V3d& p) {
      const V3d q = (p - V3d(0.13, 0.27, 0.41)) * turned().inverse();
      const double along = std::abs(q.z) - 8.3, across = std::hypot(q.x, q.y) - radius;
      return std::min(std::max(along, across), 0.0) +
             std::hypot(std::max(along, 0.0), std::max(across, 0.0));
    };
    const NarrowBand band = support::sampleBand(cylinder, cube(24), 1);
    const TriMesh mesh = bandToMesh(band, {.sharp = true});
    EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
    double worst = 0, longest = 0;
    for (const V3d& p : mesh.positions) worst = std::max(worst, std::abs(cylinder(p)));
    EXPECT_LT(worst, support::measured(0.261)) << radius;
    std::size_t turnedOver = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      const V3d &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
      longest = std::max({longest, (p - q).length(), (q - r).length(), (r - p).length()});
      const V3d area = (q - p).cross(r - p), middle = (p + q + r) / 3.0;
      if (area.length() > 0.01)
        turnedOver += cylinder(middle + 0.1 * area.normalized()) < cylinder(middle) - 0.01;
    }
    EXPECT_LE(turnedOver, 4u) << radius;
    EXPECT_LT(longest, 4) << radius;
    // A uniform mesh cuts the rims.
    const double exact = M_PI * radius * radius * 2 * 8.3,
                 lost = std::abs(signedVolume(mesh) - exact),
                 lostByUniform = std::abs(signedVolume(bandToMesh(band)) - exact);
    EXPECT_LT(lost, support::measured(0.146) * lostByUniform) << radius;
  }
}

TEST(BandToMesh, SharpDoesNotDependOnThreads) {
  const Imath::M44d back = turned().inverse();
  const NarrowBand band =
      support::sampleBand([&](const V3d& p) { return cubeDistance(p * back, 12.3); }, cube(22), 1);
  std::vector<TriMesh> meshes;
  for (const std::size_t threads : {1, 2, 4})
    support::onThreads(threads, [&] { meshes.push_back(bandToMesh(band, {.sharp = true})); });
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(meshes[0].positions, meshes[i].positions);
    EXPECT_EQ(meshes[0].triangles, meshes[i].triangles);
  }
}

TEST(BandToMesh, SharpFindsNoEdgesOnSmoothSurfaces) {
  // One quadrilateral for each crossed edge, and no inserted vertex.
  const auto torus = [](const V3d& p) { return std::hypot(std::hypot(p.x, p.y) - 24, p.z) - 9.3; };
  const std::array<NarrowBand, 2> bands = {
      sphere(12.4, 1, V3d(0.3, 0.1, -0.4)),
      support::sampleBand(torus, {V3d(-34, -34, -10), V3d(34, 34, 10)}, 1)};
  for (const NarrowBand& band : bands) {
    const TriMesh mesh = bandToMesh(band, {.sharp = true}), uniform = bandToMesh(band);
    EXPECT_EQ(mesh.triangles.size(), 2 * uniform.positions.size());
    EXPECT_EQ(measure(mesh).euler, measure(uniform).euler);
  }
}

TEST(BandToMesh, AdaptiveCoarsensFlatPartsWithinTheBound) {
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

TEST(BandToMesh, SharpIsEquallyAccurateOnASphere) {
  const double h = 1. / 32;
  const TriMesh mesh = bandToMesh(sphere(1, h, V3d(0.3 * h, 0.1 * h, -0.4 * h)), {.sharp = true});
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  double worst = 0;
  for (const V3d& p : mesh.positions) {
    worst = std::max(worst, std::abs((p - V3d(0.3 * h, 0.1 * h, -0.4 * h)).length() - 1));
  }
  EXPECT_LT(worst, support::measured(1.02) * h * h / 8);
}

TEST(BandToMesh, SharpIsClosedManifoldForEveryPatternOfSigns) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const NarrowBand band = noise(26, seed, seed % 2 == 1);
    TriMesh mesh;
    support::onThreads(1, [&] { mesh = bandToMesh(band, {.sharp = true}); });
    const Manifoldness found = manifoldness(mesh);
    EXPECT_EQ(found.boundaryEdges, 0u);
    EXPECT_EQ(found.nonManifoldEdges, 0u);
    EXPECT_EQ(found.misorientedEdges, 0u);
    EXPECT_EQ(found.nonManifoldVertices, 0u);
    support::onThreads(4, [&] {
      const TriMesh other = bandToMesh(band, {.sharp = true});
      EXPECT_EQ(mesh.positions, other.positions);
      EXPECT_EQ(mesh.triangles, other.triangles);
    });
  }
}

TEST(BandToMesh, RefusesInvalidBands) {
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
