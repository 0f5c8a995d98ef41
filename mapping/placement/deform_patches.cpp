#include "mapping/placement/deform_patches.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "levelset/error.h"
#include "levelset/mesh.h"
#include "mapping/layers/layer_resampling.h"
#include "mapping/patches/patch_mesh.h"
#include "mapping/surface/surface_field.h"

namespace mapping {
namespace {

using Imath::V3d;

/// Largest distance of a deformed particle from the surface onto which it is moved, voxels.
constexpr double kMostSnap = 1;
/// Bytes of a particle in the mesh that is certified.
constexpr double kBytesOfParticle = 150;

/// Mean distance between particles of the first layer and those above them in the last layer.
double meanRise(const Patch& patch) {
  const ParticleLayer& foot = patch.layers.front();
  const ParticleLayer top = withCounts(patch.layers.back(), foot.columns, foot.rows);
  double sum = 0;
  for (std::size_t n = 0; n < foot.positions.size(); ++n)
    sum += (top.positions[n] - foot.positions[n]).length();
  return sum / static_cast<double>(foot.positions.size());
}

void movePoints(const levelset::Deformation& deformation, std::vector<V3d>& points) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 64), [&](const auto& range) {
    for (std::size_t n = range.begin(); n != range.end(); ++n)
      points[n] = deformation.at(points[n]);
  });
}

/// Moves points onto the zero set of a base. Returns the largest distance.
/// @param isRim  true: points beside no surface stay, since a rim may lie beyond an edge
double snapPoints(const levelset::NarrowBand& base, std::vector<V3d>& points, bool isRim) {
  std::vector<double> moves(points.size());
  std::vector<char> failed(points.size(), 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 64), [&](const auto& range) {
    const SurfaceField field(base);
    for (std::size_t n = range.begin(); n != range.end(); ++n) {
      V3d p = points[n];
      failed[n] = !field.project(p, 0);
      moves[n] = (p - points[n]).length();
      if (moves[n] > kMostSnap * base.voxelSize()) failed[n] = 1;
      if (failed[n])
        moves[n] = 0;
      else
        points[n] = p;
    }
  });
  for (std::size_t n = 0; n < points.size(); ++n)
    if (failed[n] && !isRim)
      throw levelset::InvalidInput(fmt::format(
          "the deformed particle at ({:.6g}, {:.6g}, {:.6g}) is further than a voxel from the "
          "surface of the base; give the base of the patch, deformed in the same way",
          points[n].x, points[n].y, points[n].z));
  return moves.empty() ? 0 : *std::max_element(moves.begin(), moves.end());
}

/// Closed mesh around the space of all patches.
levelset::TriMesh spaceOf(std::span<const Patch> patches, std::size_t maxMemory) {
  double particles = 0;
  for (const Patch& patch : patches) particles += static_cast<double>(patch.particleCount());
  levelset::requireMemory(particles * kBytesOfParticle, maxMemory);
  levelset::TriMesh all;
  for (const Patch& patch : patches) append(all, patchMesh(patch));
  return all;
}

}  // namespace

std::vector<V3d> particlesOf(std::span<const Patch> patches) {
  std::vector<V3d> all;
  for (const Patch& patch : patches)
    for (const ParticleLayer& layer : patch.layers)
      for (const std::vector<V3d>* points : {&layer.positions, &layer.rim})
        all.insert(all.end(), points->begin(), points->end());
  return all;
}

DeformPatchesResult deformPatches(std::span<const Patch> patches,
                                  const levelset::Deformation& deformation,
                                  const DeformPatchesOptions& options) {
  DeformPatchesResult result;
  const levelset::TriMesh space = spaceOf(patches, options.maxMemory);
  result.certificate = deformation
                           .certify({space.positions, space.triangles},
                                    {.maxMemory = options.maxMemory,
                                     .progress = levelset::subProgress(options.progress, 0, 0.7)})
                           .certificate;
  requireInjective(result.certificate);
  result.patches.assign(patches.begin(), patches.end());
  const bool isIdentity = deformation.isIdentity();
  for (std::size_t p = 0; p < patches.size(); ++p) {
    levelset::report(options.progress,
                     0.7 + 0.3 * static_cast<double>(p) / static_cast<double>(patches.size()));
    Patch& moved = result.patches[p];
    deformation.requireDefined(particlesOf(patches.subspan(p, 1)), "particle");
    deformation.requireDefined({moved.corners.begin(), moved.corners.end()}, "corner");
    if (!isIdentity) {
      for (V3d& corner : moved.corners) corner = deformation.at(corner);
      for (ParticleLayer& layer : moved.layers) {
        movePoints(deformation, layer.positions);
        movePoints(deformation, layer.rim);
      }
    }
    if (options.onto) {
      std::vector<V3d> corners(moved.corners.begin(), moved.corners.end());
      const auto snap = [&](std::vector<V3d>& points, bool isRim) {
        result.largestSnap = std::max(result.largestSnap, snapPoints(*options.onto, points, isRim));
      };
      snap(moved.layers.front().positions, false);
      snap(moved.layers.front().rim, true);
      snap(corners, false);
      std::copy(corners.begin(), corners.end(), moved.corners.begin());
    }
    if (isIdentity && !options.onto) continue;
    const double before = meanRise(patches[p]);
    if (before > 0 && !isIdentity) moved.height *= meanRise(moved) / before;
    for (ParticleLayer& layer : moved.layers) layer.height = layer.w * moved.height;
    moved.spacing = meanSpacing(moved);
  }
  levelset::report(options.progress, 1);
  return result;
}

}  // namespace mapping
