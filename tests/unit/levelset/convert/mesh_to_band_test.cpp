#include "levelset/convert/mesh_to_band.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <cmath>
#include <ctime>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/vdb.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/mesh_bands.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace mesh_to_band_test {

using namespace levelset;
using namespace support;

MeshToBandResult closed(const TriMesh& mesh, double h, Nesting nesting = Nesting::Parity) {
  return meshToBand(mesh, h, {.sign = SignMode::Closed, .nesting = nesting});
}

TEST(MeshToBand, MeasuresExactlyAroundTorus) {
  const TriMesh mesh = torusMesh(1, 0.4, 32, 16, V3d(0.013, -0.021, 0.007));
  const auto result = closed(mesh, 0.13);
  expectExact(result, mesh, byWinding(mesh));
  EXPECT_TRUE(result.certificate.closed);
  EXPECT_EQ(result.certificate.method, SignMode::Closed);
}

TEST(MeshToBand, MeasuresExactlyAroundTurnedCube) {
  const TriMesh mesh =
      transformed(boxMesh(V3d(-1), V3d(1)), [](const V3d& p) { return turned(p, 0.4); });
  expectExact(closed(mesh, 0.11), mesh, byWinding(mesh));
  expectExact(meshToBand(mesh, 0.11, {.halfWidth = 5.5, .sign = SignMode::Winding}), mesh,
              byWinding(mesh));
}

TEST(MeshToBand, CountsCubeOnGridLinesOnce) {
  // Faces, edges and vertices of the mesh all fall on grid lines and points.
  const TriMesh mesh = boxMesh(V3d(-4, -4, -4), V3d(4, 3, 5));
  expectExact(closed(mesh, 1), mesh, byWinding(mesh));
  expectExact(closed(mesh, 0.5), mesh, byWinding(mesh));
}

TEST(MeshToBand, MatchesWindingNumberOfNestedComponents) {
  const TriMesh outer = sphereMesh(1, V3d(0.01, 0.02, 0.03), 12);
  const TriMesh same = joined(outer, sphereMesh(0.5, V3d(0), 10));
  const TriMesh cavity = joined(outer, reversed(sphereMesh(0.5, V3d(0), 10)));
  const double h = 0.16;
  const auto winding = [&](const TriMesh& mesh) {
    return meshToBand(mesh, h, {.sign = SignMode::Winding});
  };
  expectExact(winding(cavity), cavity, byWinding(cavity));
  // An inner component with the same orientation separates nothing.
  expectExact(winding(same), outer, byWinding(same));
  // Parity keeps the cavity for either orientation of the inner component; the winding number
  // depends on the orientation.
  expectExact(closed(same, h), cavity, byWinding(cavity));
  expectExact(closed(cavity, h), cavity, byWinding(cavity));
  expectExact(closed(cavity, h, Nesting::Orientation), cavity, byWinding(cavity));
  expectExact(closed(same, h, Nesting::Orientation), outer, byWinding(same));
}

TEST(MeshToBand, ReversesSoupThatFacesInwards) {
  const TriMesh out = sphereMesh(1, V3d(0.01, 0.02, 0.03), 8);
  const TriMesh in = soup(reversed(out), 1e-4);
  const auto result = meshToBand(in, 0.13, {.sign = SignMode::Winding});
  EXPECT_TRUE(result.certificate.flipped);
  EXPECT_FALSE(result.certificate.closed);
  EXPECT_EQ(result.certificate.boundaryEdges, 3 * in.triangles.size());
  expectExact(result, in, byWinding(in, -1));
}

TEST(MeshToBand, MeasuresDistanceToTheBoundaryOfASelfIntersectingUnion) {
  const TriMesh first = sphereMesh(1, V3d(0.01, 0.02, 0.03), 10),
                second = sphereMesh(0.8, V3d(0.9, 0.1, 0.05), 10), mesh = joined(first, second);
  const double h = 0.13;
  const auto result = meshToBand(mesh, h);
  EXPECT_EQ(result.certificate.method, SignMode::Winding);
  EXPECT_GT(result.certificate.selfIntersections, 0);
  EXPECT_EQ(result.certificate.ambiguousShare, 0);
  std::size_t apart = 0;
  for (auto it = vdb(result.band).cbeginValueOn(); it; ++it) {
    const V3d p = toImath(it.getCoord().asVec3d()) * h;
    const double value = static_cast<double>(*it);
    ASSERT_EQ(value<0, windingNumber(mesh, p)> 0.5) << p;
    // Distances to each sheet, and to its part on the boundary, outside the other component.
    double all = 1e9, boundary = 1e9;
    for (const TriMesh* shell : {&first, &second}) {
      const TriMesh& other = shell == &first ? second : first;
      for (const auto& t : shell->triangles) {
        const V3d q =
            closestPoint(shell->positions[t[0]], shell->positions[t[1]], shell->positions[t[2]], p);
        const double d = (q - p).length();
        all = std::min(all, d);
        if (d < boundary && windingNumber(other, q) < 0.5) boundary = d;
      }
    }
    // A triangle across the seam may have its nearest point inside and other points outside.
    ASSERT_GT(std::abs(value), all - 1e-4 * h) << p;
    ASSERT_LT(std::abs(value), boundary + 1e-4 * h) << p;
    apart += boundary > all + 1e-3 * h && std::abs(value) > all + 1e-3 * h;
  }
  EXPECT_GT(apart, 100u);
}

TEST(MeshToBand, SpansHoleOfHemisphere) {
  const TriMesh mesh = sphereMesh(1, V3d(0.01, 0.02, 0.03), 10, 0.5);
  const double h = 0.11;
  // Half of the rim's disc has an uncertain sign.
  EXPECT_THROW((void)meshToBand(mesh, h), InvalidInput);
  const auto result = meshToBand(mesh, h, {.acceptSign = true});
  EXPECT_EQ(result.certificate.method, SignMode::Winding);
  EXPECT_GT(result.certificate.ambiguousShare, 1e-3);
  expectOpenSound(result, mesh);
  // The rim lies in a plane that sees its opening under half the sphere, so w = 1/2 closes it with
  // a flat disc.
  auto accessor = vdb(result.band).getConstAccessor();
  for (int z = -2; z <= 2; ++z) {
    const double phi = static_cast<double>(accessor.getValue({0, 0, z}));
    EXPECT_NEAR(phi, z * h - 0.03, support::measured(5.75e-4) * h);
  }
}

TEST(MeshToBand, ClosesSmallHoleOfScan) {
  TriMesh mesh = torusMesh(1, 0.4, 48, 24, V3d(0.013, -0.021, 0.007));
  mesh.triangles.erase(mesh.triangles.begin() + 100);
  const auto result = meshToBand(mesh, 0.1);
  EXPECT_EQ(result.certificate.boundaryEdges, 3u);
  EXPECT_LT(result.certificate.ambiguousShare, 1e-3);
  expectOpenSound(result, mesh);
}

TEST(MeshToBand, KeepsFacesThatCloseSheets) {
  const TriMesh box = boxMesh(V3d(0), V3d(1));
  // A mesh with every face twice is the same solid.
  const auto twice = closed(joined(box, box), 0.1);
  EXPECT_EQ(twice.certificate.droppedTriangles, 12u);
  EXPECT_EQ(twice.band.contentHash(), closed(box, 0.1).band.contentHash());
  // Two boxes that share an edge. The edge has four faces and is still crossed an even number of
  // times.
  const TriMesh touching = joined(box, boxMesh(V3d(1, 1, 0), V3d(2, 2, 1)));
  const auto result = meshToBand(touching, 0.11);
  EXPECT_EQ(result.certificate.nonManifoldEdges, 1u);
  EXPECT_EQ(result.certificate.method, SignMode::Winding);
  expectExact(result, touching, byWinding(touching));
}

TEST(MeshToBand, MeasuresNeedlesAndDegenerateFaces) {
  // A box with a face split at a point on an edge (a T-junction closed by a face of zero area).
  TriMesh mesh = boxMesh(V3d(0), V3d(1));
  const auto middle = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.emplace_back(0.5, 0, 0);
  // {0, 2, 1} is split; its neighbour keeps the complete edge 0–1.
  mesh.triangles[0] = {0, 2, middle};
  mesh.triangles.push_back({middle, 2, 1});
  mesh.triangles.push_back({0, middle, 1});
  mesh.triangles.push_back({3, 3, 5});
  const auto result = closed(mesh, 0.13);
  EXPECT_EQ(result.certificate.droppedTriangles, 1u);
  mesh.triangles.pop_back();
  mesh.triangles.pop_back();
  expectExact(result, mesh, byWinding(mesh));
}

TEST(MeshToBand, KeepsDistancesFarFromTheOrigin) {
  const V3d far(1e6, -1e6, 1e6);
  const TriMesh near = torusMesh(1, 0.4, 24, 12);
  const TriMesh mesh = transformed(near, [&](const V3d& p) { return p + far; });
  const auto a = closed(near, 0.125), b = closed(mesh, 0.125);  // 0.125 divides the shift
  EXPECT_EQ(a.band.activeVoxelCount(), b.band.activeVoxelCount());
  const openvdb::FloatGrid &ga = vdb(a.band), &gb = vdb(b.band);
  double worst = 0;
  for (auto it = ga.cbeginValueOn(); it; ++it)
    worst = std::max(
        worst,
        std::abs(double(*it) - double(gb.tree().getValue(
                                   it.getCoord() + openvdb::Coord(8000000, -8000000, 8000000)))));
  EXPECT_LT(worst, support::rounding(0.8) * 0.125);
}

TEST(MeshToBand, FillsTilesOfLargeSolids) {
  const auto result = closed(boxMesh(V3d(-9000, -150, -150), V3d(9000, 150, 150)), 5);
  const openvdb::FloatGrid& grid = vdb(result.band);
  EXPECT_LT(grid.tree().getValue({0, 0, 0}), 0);
  EXPECT_LT(grid.tree().getValue({1700, 20, -20}), 0);
  EXPECT_GT(grid.tree().getValue({0, 40, 0}), 0);
  EXPECT_GT(grid.tree().getValue({1900, 0, 0}), 0);
}

TEST(MeshToBand, GivesTheSameBitsForAnyThreadCount) {
  const TriMesh whole = torusMesh(1, 0.4, 64, 32);
  const TriMesh open = sphereMesh(1, V3d(0.01), 10, 0.7);
  std::vector<std::uint64_t> hashes;
  for (const std::size_t threads : {1u, 3u}) {
    support::onThreads(threads, [&] {
      hashes.push_back(meshToBand(whole, 0.04).band.contentHash());
      hashes.push_back(meshToBand(open, 0.08, {.acceptSign = true}).band.contentHash());
    });
  }
  for (std::size_t i = 2; i < hashes.size(); ++i) EXPECT_EQ(hashes[i], hashes[i % 2]);
}

TEST(MeshToBand, DoesNotReadTheMeshAfterItSaysSo) {
  for (const bool isOpen : {false, true}) {
    const TriMesh mesh = isOpen ? sphereMesh(1, V3d(0.01), 10, 0.7) : torusMesh(1, 0.4, 64, 32);
    MeshToBandOptions options{.acceptSign = isOpen};
    const std::uint64_t wanted = meshToBand(mesh, 0.05, options).band.contentHash();
    TriMesh copy = mesh;
    std::size_t calls = 0;
    options.onMeshRead = [&] {
      ++calls;
      for (V3d& p : copy.positions) p = V3d(NAN);
      for (auto& t : copy.triangles) t = {0, 0, 0};
    };
    EXPECT_EQ(meshToBand(copy, 0.05, options).band.contentHash(), wanted);
    EXPECT_EQ(calls, 1u);
  }
}

TEST(MeshToBand, StopsWhenCancelled) {
  int calls = 0;
  double last = 0;
  const Progress progress = [&](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
    return ++calls < 5;
  };
  EXPECT_THROW((void)meshToBand(torusMesh(1, 0.4, 64, 32), 0.02, {.progress = progress}),
               Cancelled);
  EXPECT_GE(calls, 5);
}

/// Prism over a regular polygon, read from a file whose caps are polygons.
TriMesh prismOf(int corners) {
  std::string obj, caps[2] = {"f", "f"}, sides;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners;
    obj += fmt::format("v {0} {1} -1\nv {0} {1} 1\n", std::cos(angle), std::sin(angle));
    caps[0] += fmt::format(" {}", 2 * (corners - i) - 1);
    caps[1] += fmt::format(" {}", 2 * i + 2);
    const int next = 2 * ((i + 1) % corners);
    sides += fmt::format("f {} {} {} {}\n", 2 * i + 1, next + 1, next + 2, 2 * i + 2);
  }
  const TemporaryFolder folder;
  writeText(folder / "prism.obj", obj + caps[0] + "\n" + caps[1] + "\n" + sides);
  return readMesh(folder / "prism.obj");
}

TEST(SlowSelfIntersections, SearchesLargeCapsInTime) {
  // Written as polygons and read again, because the reader splits the caps.
  const TriMesh mesh = prismOf(100000);
  EXPECT_EQ(mesh.triangles.size(), 2 * (100000u - 2) + 2 * 100000u);
  const std::clock_t start = std::clock();
  EXPECT_EQ(countSelfIntersections(mesh), 0u);
  // CPU seconds. A test of all pairs of a cap takes minutes.
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 20);
}

TEST(SelfIntersections, HandlesFlatFansAroundACorner) {
  // A disc of triangles around one vertex is flat. A triangle that is turned over lies on another
  // one.
  TriMesh fan{{V3d(0)}, {}};
  constexpr std::uint32_t kSides = 1500;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    fan.positions.emplace_back(turned(V3d(std::cos(angle), std::sin(angle), 0), 0.3));
    fan.triangles.push_back({0, i + 1, (i + 1) % kSides + 1});
  }
  // The rotated corners lie in no plane exactly, the corners with z = 0 do.
  EXPECT_EQ(countSelfIntersections(fan), 0u);
  for (V3d& p : fan.positions) p = turned(p, -0.3), p.z = 0;
  EXPECT_EQ(countSelfIntersections(fan), 0u);
  fan.triangles.push_back({0, 11, 13});  // lies on the triangles from 11 to 12 and from 12 to 13
  EXPECT_EQ(countSelfIntersections(fan), 2u);
}

TEST(SelfIntersections, CountsIntersectingPairs) {
  EXPECT_EQ(countSelfIntersections(torusMesh(1, 0.4)), 0u);
  EXPECT_EQ(countSelfIntersections(boxMesh(V3d(0), V3d(1))), 0u);
  // A face folded back onto its neighbour, a coplanar overlap, and an edge through a face.
  const auto pair = [](const V3d& a, const V3d& b, const V3d& c) {
    TriMesh mesh{{V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0), a, b, c}, {{0, 1, 2}, {3, 4, 5}}};
    return countSelfIntersections(mesh);
  };
  EXPECT_EQ(pair(V3d(0, 0, 0), V3d(1, 0, 0), V3d(0.2, 0.3, 0)), 1u);   // shares an edge, folded
  EXPECT_EQ(pair(V3d(0, 0, 0), V3d(1, 0, 0), V3d(0.2, -0.3, 0)), 0u);  // shares an edge, flat
  EXPECT_EQ(pair(V3d(0.1, 0.1, 0), V3d(2, 0.1, 0), V3d(2, 2, 0)), 1u);
  EXPECT_EQ(pair(V3d(0.2, 0.2, -1), V3d(0.2, 0.2, 1), V3d(3, 3, 0)), 1u);
  EXPECT_EQ(pair(V3d(0, 0, 0), V3d(-1, 0, 1), V3d(0, -1, 1)), 0u);  // shares a vertex
  EXPECT_EQ(pair(V3d(0, 0, 0), V3d(1, 1, -1), V3d(1, 1, 1)), 1u);   // and passes through
  EXPECT_EQ(pair(V3d(0, 0, 1e-300), V3d(1, 0, 1e-300), V3d(0, 1, 1e-300)), 0u);
}

}  // namespace mesh_to_band_test
