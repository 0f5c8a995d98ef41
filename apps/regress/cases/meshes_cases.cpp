#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "apps/process_cost.h"
#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "apps/regress/truth/machine_part.h"
#include "levelset/convert/mesh_to_band.h"
#include "levelset/inspect/measure.h"
#include "levelset/mesh_sign/triangle_distance.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/meshing/extended_mesh.h"
#include "levelset/transform/transform.h"

namespace regress {

using Imath::M44d;
using Imath::V3d;
using levelset::TriMesh;

namespace {

/// Builds the cube of edge 1 about the origin from twelve triangles.
TriMesh cubeMesh() {
  TriMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.emplace_back((i & 1) - 0.5, ((i >> 1) & 1) - 0.5, ((i >> 2) & 1) - 0.5);
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

M44d placement(const Sample& at, bool turned) {
  M44d matrix = turned ? skewRotation() : M44d();
  M44d shift;
  shift.setTranslation(at.shift);
  return matrix * shift;
}

Truth cubeTruth(const M44d& matrix) {
  return moved(box(V3d(0), V3d(1)), matrix);
}

void convertMeshes(Recorder& out) {
  for (const Sample& at : out.samples()) {
    for (const bool turned : {false, true}) {
      const M44d matrix = placement(at, turned);
      const TriMesh mesh = levelset::transform(cubeMesh(), matrix);
      const Subject subject{turned ? "rotated cube" : "cube", at, cubeTruth(matrix)};
      out.measure(subject, kOurs, [&] { return levelset::meshToBand(mesh, at.voxelSize).band; });
      if (out.wantsPeer(at, 16))
        out.measure(subject, peer::kMesh, [&] { return peer::fromMesh(mesh, at.voxelSize); });
    }
    // Distances to a mesh are exact, so the error of a round trip is the error of the mesh.
    const Truth ring = torus(at.shift, V3d(1, 2, 3), 0.35, 0.15);
    const levelset::NarrowBand exact = exactBand(ring, at.voxelSize);
    const Subject subject{"torus and back", at, ring};
    out.measure(subject, kOurs, [&] {
      return levelset::meshToBand(levelset::bandToMesh(exact), at.voxelSize).band;
    });
    if (out.wantsPeer(at, 16))
      out.measure(subject, "OpenVDB volumeToMesh + meshToLevelSet",
                  [&] { return peer::rebuild(exact); });
  }
}

/// Returns the distance of a point to a mesh, at most `reach`; world units.
double distanceTo(const TriMesh& mesh, const V3d& point, double reach) {
  double nearest = reach * reach;
  for (const auto& t : mesh.triangles) {
    const V3d &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    const double longest = std::sqrt(std::max((b - a).length2(), (c - a).length2()));
    if ((a - point).length() - longest > std::sqrt(nearest)) continue;
    nearest = std::min(nearest, levelset::convert::TriangleFrame(a, b, c).squaredDistance(point));
  }
  return std::sqrt(nearest);
}

/// Largest distance of the cube's corners, and of points on its edges, to the mesh, in voxels.
double edgeError(const TriMesh& mesh, const M44d& matrix, double voxelSize) {
  constexpr int kPieces = 16;
  double largest = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 4; ++side)
      for (int k = 0; k <= kPieces; ++k) {
        V3d p;
        p[axis] = static_cast<double>(k) / kPieces - 0.5;
        p[(axis + 1) % 3] = (side & 1) - 0.5;
        p[(axis + 2) % 3] = (side >> 1) - 0.5;
        largest = std::max(largest, distanceTo(mesh, p * matrix, 3 * voxelSize));
      }
  return largest / voxelSize;
}

void meshEdges(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const M44d matrix = placement(at, true);
    const levelset::NarrowBand band = exactBand(cubeTruth(matrix), at.voxelSize);
    for (const bool sharp : {false, true}) {
      TriMesh mesh;
      const apps::Cost cost =
          apps::costOf([&] { mesh = levelset::bandToMesh(band, {.sharp = sharp}); });
      double farthest = 0;
      const Truth truth = cubeTruth(matrix);
      for (const V3d& p : mesh.positions)
        farthest = std::max(farthest, std::abs(truth.distance(p)));
      out.row(sharp ? "sharp" : "uniform", kOurs, at,
              {{"voxel_size", at.voxelSize},
               {"value_error", edgeError(mesh, matrix, at.voxelSize)},
               {"mesh_linf_vx", farthest / at.voxelSize},
               {"volume_error", levelset::signedVolume(mesh) - 1},
               {"area_error", levelset::surfaceArea(mesh) / 6 - 1},
               {"cpu_s", cost.cpuSeconds},
               {"peak_bytes", cost.peakBytes}});
    }
  }
}

/// Largest distance of points to a mesh, voxels.
double farthestFrom(const TriMesh& mesh, const std::vector<V3d>& points, double voxelSize) {
  double largest = 0;
  for (const V3d& p : points) largest = std::max(largest, distanceTo(mesh, p, 3 * voxelSize));
  return largest / voxelSize;
}

void meshPart(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const MachinePart part = machinePart(placement(at, true));
    // The exact test of the flat facets for intersections would take most of the time.
    const levelset::NarrowBand band =
        levelset::meshToBand(part.mesh, at.voxelSize, {.searchSelfIntersections = false}).band;
    const auto measure = [&](const char* variant, const std::function<TriMesh()>& work) {
      TriMesh mesh;
      const apps::Cost cost = apps::costOf([&] { mesh = work(); });
      double farthest = 0;
      for (const V3d& p : mesh.positions)
        farthest = std::max(farthest, std::abs(part.truth.distance(p)));
      for (const auto& t : mesh.triangles)
        farthest = std::max(
            farthest,
            std::abs(part.truth.distance(
                (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0)));
      out.row(variant, kOurs, at,
              {{"voxel_size", at.voxelSize},
               {"value_error", farthestFrom(mesh, part.edges, at.voxelSize)},
               {"mesh_linf_vx", farthest / at.voxelSize},
               {"volume_error", levelset::signedVolume(mesh) / *part.truth.volume - 1},
               {"area_error", levelset::surfaceArea(mesh) / *part.truth.area - 1},
               {"checks_failed", levelset::manifoldness(mesh).isClosedManifold() ? 0.0 : 1.0},
               {"cpu_s", cost.cpuSeconds},
               {"peak_bytes", cost.peakBytes}});
    };
    measure("marching cubes", [&] { return levelset::bandToMesh(band); });
    measure("sharp", [&] { return levelset::bandToMesh(band, {.sharp = true}); });
    measure("extended", [&] { return levelset::bandToExtendedMesh(band).mesh; });
    measure("extended, original",
            [&] { return levelset::bandToExtendedMesh(band, {.original = &part.mesh}).mesh; });
  }
}

Bounds meshRoundTripBounds() {
  return Bounds()
      .rounding("cube", "band_in_linf_vx", 1.5)
      .rounding("cube", "band_out_linf_vx", 1.5)
      .rounding("rotated cube", "band_in_linf_vx", 1.5)
      .rounding("rotated cube", "band_out_linf_vx", 1.5)
      .order("torus and back", "order_surface", {{24, 2.11}, {64, 1.99}}, 1.8)
      .measured("torus and back", "band_in_linf_vx",
                {{12, 0.17}, {16, 0.111}, {24, 0.0835}, {32, 0.066}, {64, 0.0343}, {128, 0.0177}})
      .ceiling(0.25)
      .measured("torus and back", "band_out_linf_vx",
                {{12, 0.17}, {16, 0.11}, {24, 0.0825}, {32, 0.0653}, {64, 0.033}, {128, 0.0174}})
      .ceiling(0.25)
      .measured(
          "torus and back", "surface_l1_vx",
          {{12, 0.0265}, {16, 0.0199}, {24, 0.0127}, {32, 0.00973}, {64, 0.0049}, {128, 0.00246}})
      .measured("torus and back", "missed_hits",
                {{12, 0.0215},
                 {16, 0.00669},
                 {24, 0.00109},
                 {32, 0.00286},
                 {64, 0.000578},
                 {128, 0.000346}})
      .ceiling(0.025);
}

Bounds sharpMeshBounds() {
  return Bounds()
      .measured("sharp", "value_error",
                {{16, 0.00627}, {24, 0.00245}, {32, 0.00467}, {64, 0.0478}, {128, 0.00335}})
      .ceiling(0.05)
      .measured("sharp", "mesh_linf_vx",
                {{16, 0.00396},
                 {24, 0.000823},
                 {32, 0.00272, Budget::Quick},
                 {32, 0.00878, Budget::Full},
                 {64, 0.0105},
                 {128, 0.00846}});
}

Bounds partMeshBounds() {
  constexpr double kPublished = 0.0025;
  Bounds bounds;
  for (const char* variant : {"marching cubes", "sharp", "extended", "extended, original"})
    bounds.zero(variant, "checks_failed");
  return bounds.measured("extended", "volume_error", {{32, 0.00104}, {64, 2.62e-4}})
      .ceiling(kPublished, 64)
      .measured("extended, original", "volume_error", {{32, 9.65e-4}, {64, 2.53e-4}})
      .ceiling(kPublished, 64)
      .measured("extended", "mesh_linf_vx",
                {{32, 0.209}, {64, 0.132, Budget::Quick}, {64, 0.155, Budget::Full}})
      .measured("extended, original", "mesh_linf_vx", {{32, 0.0452}, {64, 0.0221}})
      .measured("extended", "value_error", {{32, 0.302}, {64, 0.158}})
      .measured("extended, original", "value_error", {{32, 0.0343}, {64, 0.0196}});
}

}  // namespace

void addMeshCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "mesh-round-trip",
       .group = "mesh conversion",
       .title = "conversion of meshes to bands, and of a band to a mesh and back",
       .definition =
           "A cube of edge 1 made of twelve triangles, aligned with the grid and rotated, becomes "
           "a band, whose distances are known exactly. An exact band of a torus (ring radius 0.35, "
           "tube radius 0.15) becomes a mesh and a band again.",
       .citation = "closed forms; Jones95",
       .quick = {12, 16, 24},
       .full = {32, 64, 128},
       .bounds = meshRoundTripBounds(),
       .run = convertMeshes});
  all.push_back(
      {.name = "sharp-mesh",
       .group = "meshing",
       .title = "edges and corners of the mesh of a rotated cube",
       .definition =
           "The exact band of a rotated cube of edge 1 becomes a mesh, uniform and sharp. "
           "value: largest distance of the cube's corners, and of 17 points on each "
           "edge, to the mesh, in voxels.",
       .citation = "Ju02",
       .quick = {16, 24, 32},
       .full = {32, 64, 128},
       .bounds = sharpMeshBounds(),
       .run = meshEdges});
  all.push_back(
      {.name = "part-mesh",
       .group = "meshing",
       .title = "meshes of a machine part with edges, corners and a hole",
       .definition =
           "A rotated plate of length 1 with a chamfered corner and a round hole, of exact volume, "
           "becomes a band and then a mesh: by marching cubes, by the dual method with sharp "
           "edges, "
           "and by extended marching cubes with and without the original mesh. value: largest "
           "distance of points on the sharp edges and of the corners to the mesh, in voxels. "
           "checks: 1 if the mesh is not closed and 2-manifold with consistent orientation. The "
           "published error of extended marching cubes on the fandisk at 65³ is below 0.25 %.",
       .citation = "closed forms; Kobbelt01",
       .quick = {32, 64},
       .full = {64},
       .bounds = partMeshBounds(),
       .run = meshPart});
}

}  // namespace regress
