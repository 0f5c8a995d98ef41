#include "levelset/inspect/compare.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "levelset/csg/csg_vdb.h"
#include "levelset/distance/surface/closest_point.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/geometry/search/point_search.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/inspect/curved_surface.h"
#include "levelset/inspect/symmetric_difference.h"
#include "levelset/meshing/cells/cell_surface.h"
#include "levelset/progress_gate.h"
#include "levelset/transform/resample.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;

using Sample = CurvedSurface::Sample;
constexpr std::size_t kSampleChunk = 2048;

/// Calls work(chunk, first, end) for chunks of samples, in parallel.
template <typename Work>
void forEachChunk(std::size_t count, const Progress& progress, const Work& work) {
  const std::size_t chunks = (count + kSampleChunk - 1) / kSampleChunk;
  ProgressGate gate(progress, chunks);
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t chunk) {
    work(chunk, chunk * kSampleChunk, std::min(count, (chunk + 1) * kSampleChunk));
    gate.advance(1);
  });
}

/// The zero set of one solid: points sampled on it, and the data for distance queries to it.
class ZeroSet {
 public:
  ZeroSet(const NarrowBand& solid, const Progress& progress)
      : ZeroSet(vdb(solid), pointsOf(vdb(solid).constTreePtr())) {
    const IndexMesh mesh = marchCells(CellSurface(vdb(solid)));
    const CurvedSurface surface(mesh, vdb(solid));
    samples_.resize(mesh.triangles.size());
    forEachChunk(samples_.size(), progress, [&](std::size_t, std::size_t first, std::size_t end) {
      CurvedSurface::Cache cache = surface.makeCache();
      for (std::size_t i = first; i < end; ++i) samples_[i] = surface.middle(i, cache);
    });
    std::vector<TriangleItem> flat;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const auto& [a, b, c] = mesh.triangles[i];
      if (samples_[i].isFlat)
        flat.push_back(
            {{toImath(mesh.positions[a]), toImath(mesh.positions[b]), toImath(mesh.positions[c])},
             static_cast<std::uint32_t>(flat.size())});
    }
    flat_ = TriangleSearch(std::move(flat));
  }

  using Cache = eikonal::DenseBlockCache;
  [[nodiscard]] Cache makeCache() const { return Cache(*field_); }
  [[nodiscard]] bool isEmpty() const { return points_.size() == 0; }
  /// Samples in index space.
  [[nodiscard]] const std::vector<Sample>& samples() const { return samples_; }
  [[nodiscard]] Vec3d toWorld(const Vec3d& index) const { return transform_->indexToWorld(index); }

  /// Distance of a point to the zero set, world units. Newton's method starts from the nearest
  /// stored surface point and, close to the surface, also from the query point. Newton's method may
  /// fail at edges, so the flat triangles there are tested as well.
  [[nodiscard]] double distance(const Vec3d& world, Cache& cache) const {
    const Vec3d query = transform_->worldToIndex(world);
    constexpr double kAny = std::numeric_limits<double>::infinity();
    const Vec3d start = points_.positions[tree_.closest(toImath(query), kAny).index];
    double best = (query - start).length();
    for (const bool atQuery : {false, true}) {
      if (atQuery && best > kOwnStart) break;
      const Vec3d& from = atQuery ? query : start;
      const eikonal::DenseBlock& block = cache.around(from);
      const Vec3d origin = block.origin().asVec3d();
      const eikonal::Foot foot = eikonal::closestPoint(block, query - origin, from - origin);
      if (foot.converged) best = std::min(best, foot.distance);
    }
    const FoundItem hit = flat_.closest(toImath(query), best * best);
    return voxelSize_ * (hit.isValid() ? std::sqrt(hit.squared) : best);
  }

 private:
  /// Distance from the surface, voxels, below which Newton's method also starts from the query
  /// point.
  static constexpr double kOwnStart = 1.5;

  struct Points {
    FloatTree::ConstPtr field;
    eikonal::SurfacePoints points;
  };
  static Points pointsOf(FloatTree::ConstPtr field) {
    std::vector<openvdb::Coord> thin;
    eikonal::SurfacePoints points = eikonal::findSurfacePoints(*field, {}, {}, &thin);
    if (thin.empty()) return {field, std::move(points)};
    field = eikonal::thicken(*field);
    return {field, eikonal::findSurfacePoints(*field, {}, {})};
  }
  ZeroSet(const FloatGrid& grid, Points found)
      : field_(std::move(found.field)),
        points_(std::move(found.points)),
        tree_(makePointSearch(points_.positions)),
        transform_(grid.transformPtr()),
        voxelSize_(grid.voxelSize()[0]) {}

  FloatTree::ConstPtr field_;
  eikonal::SurfacePoints points_;
  PointSearch tree_;
  openvdb::math::Transform::ConstPtr transform_;
  double voxelSize_;
  std::vector<Sample> samples_;
  TriangleSearch flat_;
};

struct DistanceSums {
  double largest = 0, weighted = 0, area = 0;
};

DistanceSums distancesTo(const ZeroSet& target, const ZeroSet& surface, const Progress& progress) {
  const std::vector<Sample>& samples = surface.samples();
  std::vector<DistanceSums> parts((samples.size() + kSampleChunk - 1) / kSampleChunk);
  forEachChunk(
      samples.size(), progress, [&](std::size_t chunk, std::size_t first, std::size_t end) {
        ZeroSet::Cache cache = target.makeCache();
        for (std::size_t i = first; i < end; ++i) {
          const double distance = target.distance(surface.toWorld(samples[i].position), cache);
          parts[chunk].largest = std::max(parts[chunk].largest, distance);
          parts[chunk].weighted += distance * samples[i].area;
          parts[chunk].area += samples[i].area;
        }
      });
  DistanceSums sum;
  for (const DistanceSums& part : parts) {
    sum.largest = std::max(sum.largest, part.largest);
    sum.weighted += part.weighted;
    sum.area += part.area;
  }
  return sum;
}

double volumeOfDifference(const NarrowBand& a, const NarrowBand& b) {
  const bool firstIsFiner = a.voxelSize() <= b.voxelSize();
  const NarrowBand& fine = firstIsFiner ? a : b;
  const NarrowBand& other = firstIsFiner ? b : a;
  const double voxelVolume = fine.voxelSize() * fine.voxelSize() * fine.voxelSize();
  if (shareTransform(vdb(a), vdb(b)))
    return voxelVolume * symmetricDifference(vdb(a).tree(), vdb(b).tree());
  const NarrowBand moved = resampleTo(other, fine.indexToWorld(), {});
  return voxelVolume * symmetricDifference(vdb(fine).tree(), vdb(moved).tree());
}

}  // namespace

Comparison compare(const NarrowBand& a, const NarrowBand& b, const CompareOptions& options) {
  report(options.progress, 0);
  requireSolid(a);
  requireSolid(b);
  for (const NarrowBand* solid : {&a, &b})
    if (solid->isEmpty())
      throw InvalidInput(
          fmt::format("the {} solid is empty, so there is no surface to compare; give two solids",
                      solid == &a ? "first" : "second"));
  const ZeroSet surfaceA(a, subProgress(options.progress, 0, 0.15)),
      surfaceB(b, subProgress(options.progress, 0.15, 0.3));
  if (surfaceA.isEmpty() || surfaceB.isEmpty())
    throw InvalidInput(fmt::format(
        "the {} solid has no zero crossing, so there is no surface to compare; give two "
        "solids",
        surfaceA.isEmpty() ? "first" : "second"));
  const DistanceSums fromA =
      distancesTo(surfaceB, surfaceA, subProgress(options.progress, 0.3, 0.6));
  const DistanceSums fromB =
      distancesTo(surfaceA, surfaceB, subProgress(options.progress, 0.6, 0.9));
  Comparison result;
  result.hausdorffAtoB = fromA.largest;
  result.hausdorffBtoA = fromB.largest;
  result.meanAtoB = fromA.weighted / fromA.area;
  result.meanBtoA = fromB.weighted / fromB.area;
  result.symmetricDifference = volumeOfDifference(a, b);
  report(options.progress, 1);
  return result;
}

}  // namespace levelset
