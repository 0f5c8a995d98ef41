// Compares the explicit offset of shell maps [Porumbescu05] with the offset of a level set, on
// which the layers of a patch lie. The explicit offset moves the vertices of a mesh along their
// normals, at once, or in sixteen steps with retreat where triangles collide. Uses a ball with
// waves, and a mesh from a file.
//
//   vertex_offset_bench [MESH = none]
//
// For offsets of 2, 4 and 8 % of the diagonal, prints the share of self-intersecting triangles, the
// share of vertices that are more than a tenth of the offset nearer to the base than wanted, the
// mean difference from the wanted distance (in per cent of the offset), and CPU seconds. The level
// set has voxels of an eighth of the offset; its time includes both conversions. Exits 1 when its
// surface intersects itself, or when its mean difference exceeds 1 %.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/grids/sample.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/offset/offset.h"
#include "tests/bench/vertex_offset.h"
#include "tests/bench/wall.h"
#include "tests/support/meshes.h"

namespace {

using Imath::V3d;
using levelset::TriMesh;

constexpr int kSteps = 16;
constexpr double kVoxelsPerOffset = 8;

/// Share of the triangles that intersect another one.
double intersectingShare(const TriMesh& mesh) {
  std::vector<char> isHit(mesh.triangles.size(), 0);
  for (const auto& [a, b] :
       levelset::convert::findSelfIntersections(mesh.triangles, mesh.positions, {}))
    isHit[a] = isHit[b] = 1;
  return static_cast<double>(std::count(isHit.begin(), isHit.end(), 1)) /
         static_cast<double>(isHit.size());
}

struct Loss {
  double intersecting = 0;  ///< share of the triangles
  double low = 0;           ///< share of the vertices
  double difference = 0;    ///< mean, share of the offset
};

/// @param base  samples distances to the base
Loss lossOf(const TriMesh& mesh, const levelset::BandSampler& base, double offset) {
  Loss loss{intersectingShare(mesh)};
  for (const V3d& p : mesh.positions) {
    const double height = base.value(p) / offset;
    loss.low += height < 0.9;
    loss.difference += std::abs(height - 1);
  }
  loss.low /= static_cast<double>(mesh.positions.size());
  loss.difference /= static_cast<double>(mesh.positions.size());
  return loss;
}

/// @return true if the level set keeps its bounds
bool compare(const char* name, const TriMesh& base) {
  const double diagonal = levelset::bounds(base).size().length();
  bool keeps = true;
  for (const double share : {0.02, 0.04, 0.08}) {
    const double offset = share * diagonal, voxel = offset / kVoxelsPerOffset;
    const levelset::NarrowBand wide =
        levelset::meshToBand(base, voxel, {.halfWidth = kVoxelsPerOffset + 4}).band;
    const levelset::BandSampler distances(wide);
    const auto report = [&](const char* method, const TriMesh& mesh, double seconds) {
      const Loss loss = lossOf(mesh, distances, offset);
      fmt::print("{},{:.2f},{},{:.3f},{:.3f},{:.3f},{:.2f}\n", name, share, method,
                 100 * loss.intersecting, 100 * loss.low, 100 * loss.difference, seconds);
      std::fflush(stdout);
      return loss;
    };
    double start = wall::now();
    const TriMesh plain = vertex_offset::offsetAtOnce(base, offset).mesh;
    report("vertices", plain, wall::now() - start);
    start = wall::now();
    const TriMesh retreated = vertex_offset::offsetWithRetreat(base, offset, kSteps).mesh;
    report("retreat", retreated, wall::now() - start);
    start = wall::now();
    const TriMesh volumetric =
        levelset::bandToMesh(levelset::offset(levelset::meshToBand(base, voxel).band, offset));
    const Loss loss = report("level-set", volumetric, wall::now() - start);
    keeps = keeps && loss.intersecting == 0 && loss.difference <= 0.01;
  }
  return keeps;
}

/// Ball of radius 1 with waves along latitude and longitude.
TriMesh wavyBall() {
  TriMesh mesh = support::sphereMesh(1, V3d(0), 96);
  for (V3d& p : mesh.positions)
    p *= 1 + 0.12 * (1 - p.z * p.z) * std::cos(7 * std::atan2(p.y, p.x)) * std::cos(6 * p.z);
  return mesh;
}

}  // namespace

int main(int argc, char** argv) {
  fmt::print("base,offset,method,intersecting_percent,low_percent,difference_percent,cpu_s\n");
  bool keeps = compare("wavy-ball", wavyBall());
  if (argc > 1) keeps = compare("file", levelset::readMesh(argv[1])) && keeps;
  return keeps ? 0 : 1;
}
