#include "levelset/meshing/extended_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/meshes.h"
#include "tests/support/threads.h"

namespace extended_mesh_test {

using namespace levelset;
using Imath::V3d;

const V3d kLow(-1.03, -0.87, -0.95), kHigh(1.11, 0.91, 1.07);

TriMesh turnedBox() {
  return support::transformed(support::boxMesh(kLow, kHigh),
                              [](const V3d& p) { return support::turned(p, 0.4); });
}

/// Box with a notch along one of its edges, so that one edge and two corners are concave.
TriMesh notchedBox() {
  TriMesh mesh;
  for (const auto& [x, y] : {std::pair(-1., -1.), std::pair(1.1, -1.), std::pair(1.1, 0.1),
                             std::pair(0.2, 0.1), std::pair(0.2, 1.), std::pair(-1., 1.)})
    for (const double z : {-0.8, 0.9}) mesh.positions.emplace_back(x, y, z);
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % 6);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
  }
  // Both caps, as fans about the concave corner.
  for (const std::uint32_t i : {4u, 5u, 0u, 1u}) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % 6);
    mesh.triangles.push_back({6, b, a});
    mesh.triangles.push_back({7, a + 1, b + 1});
  }
  return support::transformed(mesh, [](const V3d& p) { return support::turned(p, 0.7); });
}

/// Largest distance of a corner of `original` from the nearest vertex of `mesh`.
double cornerError(const TriMesh& mesh, const TriMesh& original) {
  double largest = 0;
  for (const V3d& corner : original.positions) {
    double nearest = std::numeric_limits<double>::max();
    for (const V3d& p : mesh.positions) nearest = std::min(nearest, (p - corner).length());
    largest = std::max(largest, nearest);
  }
  return largest;
}

/// Largest distance of the vertices, edge midpoints and centroids of `mesh` from `original`.
double surfaceError(const TriMesh& mesh, const TriMesh& original) {
  double largest = 0;
  for (const auto& t : mesh.triangles) {
    const V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    for (const V3d& p : {a, (a + b) / 2, (b + c) / 2, (c + a) / 2, (a + b + c) / 3})
      largest = std::max(largest, support::unsignedDistance(original, p));
  }
  return largest;
}

struct Result {
  ExtendedMesh extended;
  double corner = 0, surface = 0;  ///< cornerError() and surfaceError(), voxels
  double volume = 0;               ///< relative error of the volume
};

Result meshed(const TriMesh& original, double h, bool directed) {
  Result result;
  ExtendedMeshOptions options;
  if (directed) options.original = &original;
  result.extended = bandToExtendedMesh(meshToBand(original, h).band, options);
  const TriMesh& mesh = result.extended.mesh;
  result.corner = cornerError(mesh, original) / h;
  result.surface = surfaceError(mesh, original) / h;
  result.volume = std::abs(signedVolume(mesh) / signedVolume(original) - 1);
  EXPECT_TRUE(manifoldness(mesh).isClosedManifold());
  return result;
}

TEST(ExtendedMesh, RecoversCubeExactly) {
  const TriMesh box = support::boxMesh(kLow, kHigh);
  const Result exact = meshed(box, 0.1, true), fromField = meshed(box, 0.1, false);
  for (const Result* found : {&exact, &fromField}) {
    EXPECT_EQ(found->extended.cornerVertices, 8u);
    EXPECT_EQ(found->extended.missingCrossings, 0u);
    EXPECT_EQ(found->extended.mesh.triangles.size(), 5252u);
  }
  EXPECT_LT(exact.corner, support::doubleRounding(20));
  EXPECT_LT(exact.surface, support::doubleRounding(100));
  EXPECT_LT(exact.volume, support::doubleRounding(100));
  // The values of the band are float.
  EXPECT_LT(fromField.corner, support::rounding(1));
  EXPECT_LT(fromField.surface, support::rounding(1));
}

TEST(ExtendedMesh, RecoversEdgesAndCornersOfTurnedSolids) {
  // Convex and concave edges. With the original mesh the corners are exact; elsewhere the repair of
  // folded triangles may leave an edge by 0.01 voxel.
  for (const double h : {0.13, 0.07}) {
    const Result box = meshed(turnedBox(), h, true), notched = meshed(notchedBox(), h, true);
    EXPECT_EQ(box.extended.cornerVertices, 8u);
    EXPECT_EQ(notched.extended.cornerVertices, 12u);
    for (const Result* found : {&box, &notched}) {
      EXPECT_LT(found->corner, support::doubleRounding(100));
      EXPECT_LT(found->surface, support::measured(0.0092));
      EXPECT_LT(found->volume, support::measured(2.35e-6));
    }
  }
}

TEST(ExtendedMesh, FindsEdgesAndCornersWithoutOriginal) {
  for (const double h : {0.13, 0.07}) {
    const Result box = meshed(turnedBox(), h, false), notched = meshed(notchedBox(), h, false);
    EXPECT_EQ(box.extended.cornerVertices, 8u);
    EXPECT_EQ(notched.extended.cornerVertices, 12u);
    for (const Result* found : {&box, &notched}) {
      EXPECT_LT(found->corner, support::measured(0.096));
      EXPECT_LT(found->surface, support::measured(0.124));
      EXPECT_LT(found->volume, support::measured(7.5e-5));
    }
  }
}

/// Ring of radii 1 and 1.5 with fine facets, turned and moved.
TriMesh turnedRing(double angle, double shift) {
  constexpr std::uint32_t kFacets = 720;
  TriMesh mesh;
  for (std::uint32_t i = 0; i < kFacets; ++i) {
    const double at = 2 * std::numbers::pi * i / kFacets;
    for (const V3d& p : {V3d(1, 0, -0.5), V3d(1.5, 0, -0.5), V3d(1.5, 0, 0.5), V3d(1, 0, 0.5)})
      mesh.positions.emplace_back(p.x * std::cos(at), p.x * std::sin(at), p.z);
    const std::uint32_t a = 4 * i, b = 4 * ((i + 1) % kFacets);
    for (std::uint32_t k = 0; k < 4; ++k) {
      const std::uint32_t next = (k + 1) % 4;
      mesh.triangles.push_back({a + k, b + k, b + next});
      mesh.triangles.push_back({a + k, b + next, a + next});
    }
  }
  return support::transformed(mesh, [&](const V3d& p) {
    return support::turned(p, angle) + V3d(shift, 0.3 * shift, 0.1 * shift);
  });
}

TEST(ExtendedMesh, KeepsTrianglesShortAlongCurvedEdges) {
  // In these placements, repeated removals of vertices left edges of 3.9 and 3.7 voxels.
  const double h = 1 / 11.0;
  for (const auto& [angle, shift] : {std::pair(0.3, 0.0), std::pair(0.85, 11 / 8.0)}) {
    const NarrowBand band = meshToBand(turnedRing(angle, shift * h), h).band;
    const TriMesh mesh = bandToExtendedMesh(band).mesh;
    double longest = 0;
    for (const auto& t : mesh.triangles)
      for (std::size_t k = 0; k < 3; ++k)
        longest =
            std::max(longest, (mesh.positions[t[k]] - mesh.positions[t[(k + 1) % 3]]).length());
    EXPECT_LT(longest / h, 3) << angle;
  }
}

TEST(ExtendedMesh, ConvergesOnSphereWithOrderTwo) {
  double before = 0;
  for (const double h : {0.1, 0.05, 0.025}) {
    const auto phi = [](const V3d& p) { return p.length() - 1; };
    const ExtendedMesh found = bandToExtendedMesh(support::sampleBand(phi, {V3d(-1), V3d(1)}, h));
    EXPECT_EQ(found.edgeVertices + found.cornerVertices, 0u);
    const double error = 1 - signedVolume(found.mesh) / (4. / 3 * std::numbers::pi);
    if (before > 0) {
      EXPECT_GT(std::log2(before / error), support::measuredOrder(2));
    }
    before = error;
  }
  EXPECT_LT(before, support::measured(3.9e-4));
}

TEST(ExtendedMesh, EqualsMarchingCubesWithoutFeatures) {
  const NarrowBand band = meshToBand(support::torusMesh(2, 0.8, 256, 128), 0.08).band;
  const ExtendedMesh found = bandToExtendedMesh(band);
  const TriMesh uniform = bandToMesh(band);
  EXPECT_EQ(found.edgeVertices + found.cornerVertices, 0u);
  EXPECT_EQ(found.mesh.triangles, uniform.triangles);
  EXPECT_EQ(found.mesh.positions, uniform.positions);
  EXPECT_GT(uniform.triangles.size(), 20000u);
}

TEST(ExtendedMesh, PutsVerticesOnOriginal) {
  // The facets are finer than the grid, so that the normals within a cell form no feature.
  const TriMesh original = support::torusMesh(2, 0.8, 256, 128);
  const ExtendedMesh found =
      bandToExtendedMesh(meshToBand(original, 0.1).band, {.original = &original});
  EXPECT_EQ(found.missingCrossings, 0u);
  ASSERT_EQ(found.edgeVertices + found.cornerVertices, 0u);
  double largest = 0;
  for (std::size_t i = 0; i < found.mesh.positions.size(); i += 41)
    largest = std::max(largest, support::unsignedDistance(original, found.mesh.positions[i]));
  EXPECT_LT(largest, support::doubleRounding(100));
}

TEST(ExtendedMesh, TakesNormalsOutwardFromTheSigns) {
  const TriMesh original = turnedBox(), inverted = support::reversed(original);
  const NarrowBand band = meshToBand(original, 0.1).band;
  const TriMesh a = bandToExtendedMesh(band, {.original = &original}).mesh,
                b = bandToExtendedMesh(band, {.original = &inverted}).mesh;
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_NEAR(signedVolume(a), signedVolume(b), support::doubleRounding(100));
}

TEST(ExtendedMesh, TakesMissingCrossingsFromTheField) {
  // One face of the box is gone.
  const TriMesh whole = support::boxMesh(kLow, kHigh);
  TriMesh open = whole;
  open.triangles.resize(10);
  const NarrowBand band = meshToBand(whole, 0.1).band;
  const ExtendedMesh found = bandToExtendedMesh(band, {.original = &open});
  EXPECT_GT(found.missingCrossings, 300u);
  EXPECT_LT(found.missingCrossings, 400u);
  EXPECT_TRUE(manifoldness(found.mesh).isClosedManifold());
  EXPECT_LT(cornerError(found.mesh, whole), support::rounding(1));
}

TEST(ExtendedMesh, HasEqualBitsOnAnyNumberOfThreads) {
  const TriMesh original = notchedBox();
  const NarrowBand band = meshToBand(original, 0.05).band;
  for (const TriMesh* directed : {static_cast<const TriMesh*>(nullptr), &original}) {
    const auto run = [&](std::size_t threads) {
      return support::onThreads(
          threads, [&] { return bandToExtendedMesh(band, {.original = directed}).mesh; });
    };
    const TriMesh one = run(1), eight = run(8);
    EXPECT_EQ(one.positions, eight.positions);
    EXPECT_EQ(one.triangles, eight.triangles);
  }
}

TEST(ExtendedMesh, RefusesOriginalsThatCannotBelongToTheBand) {
  const TriMesh box = support::boxMesh(kLow, kHigh);
  const NarrowBand band = meshToBand(box, 0.1).band;
  const auto refuses = [&](const TriMesh& original, const char* part) {
    try {
      (void)bandToExtendedMesh(band, {.original = &original});
      ADD_FAILURE() << "no refusal: " << part;
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  refuses(TriMesh(), "has no triangles");
  refuses(support::transformed(box, [](const V3d& p) { return p + V3d(9, 0, 0); }),
          "meets no grid edge");
  TriMesh broken = box;
  broken.positions[5].y = std::numeric_limits<double>::quiet_NaN();
  refuses(broken, "vertex 5 of the original mesh");
  broken = box;
  broken.triangles[3][1] = 8;
  refuses(broken, "triangle 3 of the original mesh refers to vertex 8");
  EXPECT_THROW((void)bandToExtendedMesh(makeBand(emptyLevelSet(uniformTransform(1), 3))),
               InvalidInput);
}

}  // namespace extended_mesh_test
