#include "levelset/meshing/extended_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
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

/// Number of triangles without area.
std::size_t slivers(const TriMesh& mesh, double least) {
  std::size_t count = 0;
  for (const auto& t : mesh.triangles) {
    const V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    count += (b - a).cross(c - a).length() / 2 < least;
  }
  return count;
}

struct Result {
  ExtendedMesh extended;
  double corner, surface, volume;
};

Result meshed(const TriMesh& original, double h, bool directed) {
  Result result;
  const NarrowBand band = meshToBand(original, h).band;
  ExtendedMeshOptions options;
  if (directed) options.original = &original;
  result.extended = bandToExtendedMesh(band, options);
  const TriMesh& mesh = result.extended.mesh;
  result.corner = cornerError(mesh, original) / h;
  result.surface = surfaceError(mesh, original) / h;
  result.volume = signedVolume(mesh) / signedVolume(original) - 1;
  const Manifoldness found = manifoldness(mesh);
  EXPECT_TRUE(found.isClosedManifold());
  std::printf("XX n=%zu corner %g surface %g volume %g edges %zu corners %zu missing %zu/%zu sliv %zu bad %d\n",
              mesh.triangles.size(), result.corner, result.surface, result.volume,
              result.extended.edgeVertices, result.extended.cornerVertices,
              result.extended.missingCrossings, result.extended.crossings, slivers(mesh, 1e-4*h*h), !found.isClosedManifold());
  return result;
}

TEST(ExtendedMesh, Experiment) {
  for (double h : {0.2, 0.13, 0.1, 0.07, 0.03})
    for (bool directed : {true, false}) {
      std::printf("h %g directed %d\n", h, directed);
      meshed(turnedBox(), h, directed);
      meshed(notchedBox(), h, directed);
      meshed(support::boxMesh(kLow, kHigh), h, directed);
    }
}

}  // namespace extended_mesh_test
