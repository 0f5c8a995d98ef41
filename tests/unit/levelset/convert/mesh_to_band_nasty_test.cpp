// Meshes that break converters, each with its correct outcome.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/mesh_files/mesh_file.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/mesh_bands.h"

namespace mesh_to_band_nasty_test {

using namespace levelset;
using namespace support;

constexpr double kTurn = 2 * std::numbers::pi;

void expectSays(const std::string& sentence, const std::string& words) {
  EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
}

/// Strip around the z axis whose last row is the first row mirrored, so that it has one side only.
TriMesh twisted(unsigned m, unsigned n, bool closedAcross,
                const std::function<V3d(double, double)>& place) {
  TriMesh mesh = patchMesh(m + 1, n, false, closedAcross, place);
  for (auto& t : mesh.triangles)
    for (auto& v : t)
      if (v >= m * n) v = closedAcross ? (n - (v - m * n)) % n : n - 1 - (v - m * n);
  mesh.positions.resize(m * n);
  return mesh;
}

/// Figure-eight immersion of the Klein bottle: a closed surface without an inside.
TriMesh kleinBottle() {
  return twisted(48, 24, true, [](double u, double v) {
    const double a = kTurn * u, b = kTurn * v;
    const double r = 1 + 0.4 * (std::cos(a / 2) * std::sin(b) - std::sin(a / 2) * std::sin(2 * b));
    return V3d(r * std::cos(a), r * std::sin(a),
               0.4 * (std::sin(a / 2) * std::sin(b) + std::cos(a / 2) * std::sin(2 * b)));
  });
}

TEST(MeshToBandNasty, SurfacesWithoutAnInside) {
  // Every edge of a Klein bottle has two faces, so only the search for intersections finds that it
  // crosses itself.
  const TriMesh klein = kleinBottle();
  EXPECT_GT(countSelfIntersections(klein), 0u);
  expectSays(refusal<InvalidInput>([&] { (void)meshToBand(klein, 0.07); }), "are a guess at");
  // Parity still gives an answer: the two tubes of the eight.
  const auto parity = meshToBand(klein, 0.07, {.sign = SignMode::Closed});
  EXPECT_TRUE(parity.certificate.closed);
  expectSays(refusal<InvalidInput>([&] {
               (void)meshToBand(klein, 0.07,
                                {.sign = SignMode::Closed, .nesting = Nesting::Orientation});
             }),
             "--nested parity");
  const TriMesh moebius = twisted(32, 5, false, [](double u, double v) {
    const double a = kTurn * u, w = v - 0.5, r = 1 + w * std::cos(a / 2);
    return V3d(r * std::cos(a), r * std::sin(a), w * std::sin(a / 2));
  });
  for (const SignMode sign : {SignMode::Auto, SignMode::Winding})
    expectSays(refusal<InvalidInput>([&] { (void)meshToBand(moebius, 0.1, {.sign = sign}); }),
               "are a guess at");
}

TEST(MeshToBandNasty, BowTieVertex) {
  TriMesh mesh = joined(boxMesh(V3d(-1), V3d(0)), boxMesh(V3d(0), V3d(1)));
  const auto result = meshToBand(mesh, 0.11);
  EXPECT_EQ(result.certificate.method, SignMode::Closed);
  EXPECT_EQ(result.certificate.selfIntersections, 0);
  expectExact(result, mesh, byWinding(mesh));
}

TEST(MeshToBandNasty, TJunctions) {
  // The edge 0–1 is split for only one of its faces. There is no gap, but there are three edges
  // with one face.
  TriMesh mesh = boxMesh(V3d(0), V3d(1));
  const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.emplace_back(0.5, 0, 0);
  mesh.triangles[0] = {0, 2, middle};
  mesh.triangles.push_back({middle, 2, 1});
  expectSays(
      refusal<InvalidInput>([&] { (void)meshToBand(mesh, 0.13, {.sign = SignMode::Closed}); }),
      "3 edges have one face");
  const auto result = meshToBand(mesh, 0.13);
  EXPECT_EQ(result.certificate.method, SignMode::Winding);
  EXPECT_EQ(result.certificate.ambiguousShare, 0);
  expectExact(result, mesh, byWinding(boxMesh(V3d(0), V3d(1))));
}

TEST(MeshToBandNasty, ComponentsCloserThanAVoxel) {
  const double h = 0.1;
  for (const double gap : {0.3 * h, 1e-9}) {
    const TriMesh mesh =
        joined(boxMesh(V3d(-1), V3d(0.013, 1, 1)), boxMesh(V3d(0.013 + gap, -1, -1), V3d(1)));
    const auto result = meshToBand(mesh, h);
    EXPECT_EQ(result.certificate.method, SignMode::Closed);
    expectExact(result, mesh, byWinding(mesh));
  }
  // A sheet thinner than a voxel beside a solid is kept where grid points lie in it.
  const TriMesh fin =
      joined(boxMesh(V3d(-1), V3d(1)), boxMesh(V3d(1.2, -1, -1), V3d(1.2 + 0.4 * h, 1, 1)));
  expectExact(meshToBand(fin, h), fin, byWinding(fin));
}

TEST(MeshToBandNasty, RepeatedAndOppositeFaces) {
  TriMesh mesh = boxMesh(V3d(0), V3d(1));
  mesh.triangles.push_back({0, 2, 1});  // the same face again
  const auto repeated = meshToBand(mesh, 0.11);
  EXPECT_EQ(repeated.certificate.method, SignMode::Closed);
  EXPECT_EQ(repeated.certificate.droppedTriangles, 1u);
  EXPECT_EQ(repeated.band.contentHash(),
            meshToBand(boxMesh(V3d(0), V3d(1)), 0.11).band.contentHash());
  mesh.triangles.back() = {0, 1, 2};  // the opposite face; both cancel and leave a hole
  expectSays(refusal<InvalidInput>([&] { (void)meshToBand(mesh, 0.11); }), "--accept-sign");
  expectOpenSound(meshToBand(mesh, 0.11, {.acceptSign = true}), mesh);
}

/// Adds a rectangle across an axis, as two triangles of a soup. Distances do not depend on its
/// orientation.
void addRectangle(TriMesh& mesh, const V3d& low, const V3d& high) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  const int flat = low.x == high.x ? 0 : (low.y == high.y ? 1 : 2), u = (flat + 1) % 3;
  V3d a = low, b = high;
  a[u] = high[u];
  b[u] = low[u];
  mesh.positions.insert(mesh.positions.end(), {low, a, high, b});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
}

/// Adds the faces of a box except the listed ones: 0 for low x, 1 for high x, 2 for low y, …
void addBox(TriMesh& mesh, const V3d& low, const V3d& high, std::initializer_list<int> without) {
  for (int face = 0; face < 6; ++face) {
    if (std::find(without.begin(), without.end(), face) != without.end()) continue;
    V3d a = low, b = high;
    a[face / 2] = b[face / 2] = face % 2 ? high[face / 2] : low[face / 2];
    addRectangle(mesh, a, b);
  }
}

TEST(MeshToBandNasty, BoxesThroughEachOther) {
  // A pillar of twelve triangles through the top of a block of twelve. Inner faces separate
  // nothing, and distances are those to the boundary of the union.
  const TriMesh mesh =
      joined(boxMesh(V3d(-1), V3d(1)), boxMesh(V3d(-0.5, -0.4, 0), V3d(0.5, 0.4, 2)));
  TriMesh boundary;
  addBox(boundary, V3d(-1), V3d(1), {5});
  addBox(boundary, V3d(-0.5, -0.4, 1), V3d(0.5, 0.4, 2), {4});
  addRectangle(boundary, V3d(-1, -1, 1), V3d(-0.5, 1, 1));
  addRectangle(boundary, V3d(0.5, -1, 1), V3d(1, 1, 1));
  addRectangle(boundary, V3d(-0.5, -1, 1), V3d(0.5, -0.4, 1));
  addRectangle(boundary, V3d(-0.5, 0.4, 1), V3d(0.5, 1, 1));
  const auto turn = [](const V3d& p) { return turned(p, 0.3); };
  for (const double angle : {0.0, 0.3}) {
    const TriMesh solid = angle > 0 ? transformed(mesh, turn) : mesh;
    const TriMesh truth = angle > 0 ? transformed(boundary, turn) : boundary;
    const auto result = meshToBand(solid, 0.083);
    EXPECT_EQ(result.certificate.method, SignMode::Winding);
    expectExact(result, truth, byWinding(solid));
  }
}

TEST(MeshToBandNasty, CoplanarOverlaps) {
  // Two boxes whose tops lie in one plane and overlap.
  const TriMesh mesh = joined(boxMesh(V3d(-1, -1, -1), V3d(0.3, 1, 1)),
                              boxMesh(V3d(-0.3, -0.5, -0.5), V3d(1, 0.5, 1)));
  TriMesh boundary;
  addBox(boundary, V3d(-1, -1, -1), V3d(0.3, 1, 1), {1});
  addBox(boundary, V3d(0.3, -0.5, -0.5), V3d(1, 0.5, 1), {0});
  addRectangle(boundary, V3d(0.3, -1, -1), V3d(0.3, -0.5, 1));
  addRectangle(boundary, V3d(0.3, 0.5, -1), V3d(0.3, 1, 1));
  addRectangle(boundary, V3d(0.3, -0.5, -1), V3d(0.3, 0.5, -0.5));
  const auto result = meshToBand(mesh, 0.11);
  EXPECT_EQ(result.certificate.method, SignMode::Winding);
  EXPECT_GT(result.certificate.selfIntersections, 0);
  EXPECT_EQ(result.certificate.ambiguousShare, 0);
  expectExact(result, boundary, byWinding(mesh));
  // Boxes that share a face: it has the solid on both sides.
  const TriMesh touching =
      joined(boxMesh(V3d(-1), V3d(0.013, 1, 1)), boxMesh(V3d(0.013, -1, -1), V3d(1)));
  expectExact(meshToBand(touching, 0.11), boxMesh(V3d(-1), V3d(1)), byWinding(touching));
}

TEST(MeshToBandNasty, IslandsAMillionApart) {
  const TriMesh left = sphereMesh(1, V3d(-5e5, 0.01, 0.02), 10);
  const TriMesh mesh = joined(left, sphereMesh(1, V3d(5e5, 0.01, 0.02), 10));
  constexpr double kVoxel = 0.16;  // divides the distance of the islands
  const auto result = meshToBand(mesh, kVoxel);
  EXPECT_EQ(result.certificate.method, SignMode::Closed);
  double worst = 0;
  for (auto it = vdb(result.band).cbeginValueOn(); it; ++it) {
    const V3d p = toImath(it.getCoord().asVec3d()) * kVoxel;
    const double exact = unsignedDistance(mesh, p);
    worst = std::max(worst, std::abs(std::abs(static_cast<double>(*it)) - exact));
    ASSERT_EQ(*it < 0,
              (V3d(std::abs(p.x) - 5e5, p.y - 0.01, p.z - 0.02)).length() < 1 - exact / 2 &&
                  windingNumber(mesh, p) > 0.5);
  }
  EXPECT_LT(worst, support::rounding(0.2));
  // The space between is empty: no tile of the tree is inside.
  EXPECT_GT(vdb(result.band).tree().getValue({0, 0, 0}), 0);
  EXPECT_EQ(result.band.activeVoxelCount(), 2 * meshToBand(left, kVoxel).band.activeVoxelCount());
}

/// Converts a ball of `rings` rings of triangles that are far smaller than a voxel.
void expectBallOfTiny(unsigned rings) {
  const V3d center(0.01, 0.02, 0.03);
  const TriMesh mesh = sphereMesh(1, center, rings);
  EXPECT_GT(mesh.triangles.size(), 39ull * rings * rings / 10);
  const double h = 0.11;
  const auto result = meshToBand(mesh, h);
  EXPECT_EQ(result.certificate.method, SignMode::Closed);
  double worst = 0;
  for (auto it = vdb(result.band).cbeginValueOn(); it; ++it) {
    const V3d p = toImath(it.getCoord().asVec3d()) * h - center;
    worst = std::max(worst, std::abs(static_cast<double>(*it) - (p.length() - 1)));
  }
  // Chords lie (π / rings)² / 8 below the sphere, in both directions. Single precision adds the
  // rest.
  const double chord = std::numbers::pi / rings;
  EXPECT_LT(worst, 2 * chord * chord / 8 + 1e-6);
}

TEST(MeshToBandNasty, AQuarterMillionTrianglesSmallerThanAVoxel) {
  expectBallOfTiny(250);
}

TEST(SlowMeshToBandNasty, TenMillionTrianglesSmallerThanAVoxel) {
  expectBallOfTiny(1582);
}

TEST(MeshToBandNasty, TwelveTrianglesLargerThanTheGrid) {
  const V3d low(-40.3, -35.1, -30.7), high(39.9, 33.6, 28.2);
  const auto result = meshToBand(boxMesh(low, high), 1);
  std::size_t count = 0;
  double worst = 0;
  for (auto it = vdb(result.band).cbeginValueOn(); it; ++it, ++count) {
    const V3d p = toImath(it.getCoord().asVec3d());
    V3d out(0);
    double inside = -1e9;
    for (int axis = 0; axis < 3; ++axis) {
      const double d = std::max(low[axis] - p[axis], p[axis] - high[axis]);
      out[axis] = std::max(d, 0.0);
      inside = std::max(inside, d);
    }
    worst =
        std::max(worst, std::abs(static_cast<double>(*it) - (inside < 0 ? inside : out.length())));
  }
  EXPECT_GT(count, 125000u);
  EXPECT_LT(worst, support::rounding(1.5));
}

/// Converts a soup in which no triangles share a vertex. `tolerance` covers the chords and the
/// jitter.
void expectSoup(unsigned rings, double tolerance) {
  const TriMesh mesh = soup(sphereMesh(1, V3d(0.01, 0.02, 0.03), rings), 1e-5);
  const double h = 0.07;
  const auto result = meshToBand(mesh, h);
  EXPECT_EQ(result.certificate.method, SignMode::Winding);
  EXPECT_EQ(result.certificate.boundaryEdges, 3 * mesh.triangles.size());
  EXPECT_LT(result.certificate.ambiguousShare, 1e-3);
  double worst = 0;
  for (auto it = vdb(result.band).cbeginValueOn(); it; ++it) {
    const V3d p = toImath(it.getCoord().asVec3d()) * h - V3d(0.01, 0.02, 0.03);
    worst = std::max(worst, std::abs(static_cast<double>(*it) - (p.length() - 1)));
  }
  EXPECT_LT(worst, tolerance);
}

TEST(MeshToBandNasty, Soup) {
  expectSoup(30, 3e-3);
}

TEST(SlowMeshToBandNasty, SoupOf57600Triangles) {
  expectSoup(120, 3e-4);
}

/// Converts scans with edges of three and more faces. Compares signs with the directly summed
/// winding number at every `stride`th voxel of the band.
void expectScan(const std::string& name, double voxels, std::size_t stride) {
  const std::filesystem::path file = std::filesystem::path(LEVELSMITH_DATA_DIR) / "models" / name;
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is missing: run data/fetch";
  const TriMesh mesh = readMesh(file);
  const V3d size = bounds(mesh).size();
  const double h = std::max({size.x, size.y, size.z}) / voxels;
  const auto result = meshToBand(mesh, h);
  EXPECT_EQ(result.certificate.method, SignMode::Winding);
  EXPECT_GT(result.certificate.nonManifoldEdges + result.certificate.boundaryEdges, 0u);
  std::vector<std::pair<V3d, bool>> chosen;
  std::size_t count = 0;
  for (auto it = vdb(result.band).cbeginValueOn(); it; ++it)
    if (count++ % stride == 0) chosen.emplace_back(toImath(it.getCoord().asVec3d()) * h, *it < 0);
  EXPECT_GT(chosen.size(), 1000u);
  std::vector<int> wrong(chosen.size(), 0);
  tbb::parallel_for(std::size_t{0}, chosen.size(), [&](std::size_t i) {
    const double w = windingNumber(mesh, chosen[i].first);
    wrong[i] = std::abs(w - 0.5) > 1e-9 && (w > 0.5) != chosen[i].second;
  });
  EXPECT_EQ(std::count(wrong.begin(), wrong.end(), 1), 0);
}

TEST(MeshToBandNasty, DragonOfElevenThousandTriangles) {
  expectScan("dragon_vrip_res4.ply.gz", 100, 20);
}

TEST(SlowMeshToBandNasty, DecimatedDragons) {
  expectScan("dragon_vrip_res4.ply.gz", 200, 20);
  expectScan("dragon_vrip_res3.ply.gz", 200, 50);
  expectScan("dragon_vrip_res2.ply.gz", 200, 200);
}

/// Prism over a polygon in the plane z = 0, counter-clockwise. All of the polygon is visible from
/// its first corner.
TriMesh prism(const std::vector<V3d>& base, double height) {
  TriMesh mesh;
  const auto n = static_cast<std::uint32_t>(base.size());
  mesh.positions = base;
  for (const V3d& p : base) mesh.positions.push_back(p + V3d(0, 0, height));
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    mesh.triangles.push_back({0, i + 1, i});
    mesh.triangles.push_back({n, n + i, n + i + 1});
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
  }
  return mesh;
}

TEST(MeshToBandNasty, FacesThroughGridPointsLeaveNoSpecks) {
  const TriMesh bracket =
      prism({{4, 4, 0}, {4, 8, 0}, {0, 8, 0}, {0, 0, 0}, {8, 0, 0}, {8, 4, 0}}, 4);
  const TriMesh wedge = prism({{0, 0, 0}, {8, 0, 0}, {0, 8, 0}}, 8);
  TriMesh tetrahedron;
  tetrahedron.positions = {{0, 0, 0}, {8, 0, 0}, {0, 8, 0}, {0, 0, 8}};
  tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  for (const TriMesh& mesh : {bracket, wedge, tetrahedron})
    for (const double voxel : {1.0, 0.5, 0.25})
      for (const SignMode sign : {SignMode::Closed, SignMode::Winding}) {
        const Measurement found = measure(meshToBand(mesh, voxel, {.sign = sign}).band);
        EXPECT_EQ(found.components, 1u) << voxel;
        // Edges are rounded by up to half a square voxel in cross-section.
        EXPECT_NEAR(found.volume, signedVolume(mesh),
                    support::measured(0.189, 0.2) * voxel * surfaceArea(mesh))
            << voxel;
      }
  // In the small tetrahedron only points of its faces are grid points, so no grid point is inside.
  for (V3d& p : tetrahedron.positions) p /= 8;
  expectSays(refusal<InvalidInput>([&] { (void)meshToBand(tetrahedron, 0.9); }),
             "no grid point lies inside");
}

TEST(MeshToBandNasty, IgnoresVerticesThatNoFaceUses) {
  TriMesh mesh = boxMesh(V3d(0), V3d(1));
  mesh.positions.emplace_back(100, 100, 100);
  EXPECT_EQ(bounds(mesh).max, V3d(1));
  EXPECT_EQ(meshToBand(mesh, 0.1).band.contentHash(),
            meshToBand(boxMesh(V3d(0), V3d(1)), 0.1).band.contentHash());
}

}  // namespace mesh_to_band_nasty_test
