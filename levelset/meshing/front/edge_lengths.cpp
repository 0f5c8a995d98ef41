#include "levelset/meshing/front/edge_lengths.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <utility>

#include "levelset/geometry/perpendicular.h"
#include "levelset/grids/sample.h"

namespace levelset {
namespace {

using Imath::V3d;

/// Returns the largest absolute curvature at a point near the zero set: differences of the normals
/// over two voxels along two tangents. 0 outside the band.
double largestCurvature(const BandSampler& field, const V3d& at, double voxel) {
  const V3d normal = field.gradient(at).normalized();
  if (!(normal.length2() > 0.5)) return 0;
  const std::array<V3d, 2> along = tangents(normal);
  double shape[2][2];
  for (int i = 0; i < 2; ++i) {
    const V3d step = along[i] * voxel;
    const V3d change =
        (field.gradient(at + step).normalized() - field.gradient(at - step).normalized()) /
        (2 * voxel);
    for (int j = 0; j < 2; ++j) shape[i][j] = change.dot(along[j]);
  }
  const double mean = (shape[0][0] + shape[1][1]) / 2, half = (shape[0][0] - shape[1][1]) / 2,
               twist = (shape[0][1] + shape[1][0]) / 2;
  return std::abs(mean) + std::sqrt(half * half + twist * twist);
}

/// Lowers the lengths until they change slowly along the edges of a mesh.
void limitGradation(const TriMesh& surface, std::vector<double>& lengths) {
  // === Neighbours of vertex v: ends[first[v]] to ends[first[v + 1] − 1]
  std::vector<std::size_t> first(lengths.size() + 1, 0);
  for (const auto& t : surface.triangles)
    for (const std::uint32_t v : t) ++first[v + 1];
  for (std::size_t v = 0; v < lengths.size(); ++v) first[v + 1] += first[v];
  std::vector<std::uint32_t> ends(first.back());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (const auto& t : surface.triangles)
    for (std::size_t i = 0; i < 3; ++i) ends[next[t[i]]++] = t[(i + 1) % 3];

  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (std::uint32_t v = 0; v < lengths.size(); ++v) queue.emplace(lengths[v], v);
  while (!queue.empty()) {
    const auto [length, v] = queue.top();
    queue.pop();
    if (length > lengths[v]) continue;
    for (std::size_t i = first[v]; i < first[v + 1]; ++i) {
      const std::uint32_t w = ends[i];
      const double limit =
          length + kGradation * (surface.positions[v] - surface.positions[w]).length();
      if (limit >= lengths[w]) continue;
      lengths[w] = limit;
      queue.emplace(limit, w);
    }
  }
}

}  // namespace

EdgeLengths edgeLengths(const NarrowBand& band, const TriMesh& surface, const EdgeLimits& limits) {
  const double voxel = band.voxelSize(), chord = 2 * std::sin(limits.angle / 2);
  EdgeLengths result;
  result.lengths.resize(surface.positions.size());
  result.curvatures.resize(surface.positions.size());
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, surface.positions.size(), 1024),
      [&](const tbb::blocked_range<std::size_t>& range) {
        const BandSampler field(band, Interpolation::Tricubic);
        for (std::size_t v = range.begin(); v < range.end(); ++v) {
          const double curvature = largestCurvature(field, surface.positions[v], voxel);
          result.curvatures[v] = curvature;
          result.lengths[v] = curvature > 0
                                  ? std::clamp(chord / curvature, limits.shortest, limits.longest)
                                  : limits.longest;
        }
      });
  limitGradation(surface, result.lengths);
  return result;
}

}  // namespace levelset
