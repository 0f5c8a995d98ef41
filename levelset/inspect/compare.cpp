#include "levelset/inspect/compare.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "levelset/eikonal/closest_point.h"
#include "levelset/eikonal/point_tree.h"
#include "levelset/eikonal/surface_points.h"
#include "levelset/error.h"
#include "levelset/inspect/curved_surface.h"
#include "levelset/inspect/symmetric_difference.h"
#include "levelset/meshing/cell_surface.h"
#include "levelset/solids/csg_vdb.h"
#include "levelset/solids/resample.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;

/// The zero set of one solid, to measure distances to.
class ZeroSet {
 public:
  explicit ZeroSet(const NarrowBand& solid)
      : ZeroSet(vdb(solid), pointsOf(vdb(solid).constTreePtr())) {}

  using Cache = eikonal::DenseBlockCache;
  [[nodiscard]] Cache makeCache() const { return Cache(*field_); }
  [[nodiscard]] bool isEmpty() const { return points_.size() == 0; }

  /// World units. The nearest of the known points is where Newton's method starts from.
  [[nodiscard]] double distance(const Vec3d& world, Cache& cache) const {
    const Vec3d query = transform_->worldToIndex(world);
    const Vec3d start = points_.positions[tree_.nearest(query, std::numeric_limits<double>::max())];
    const eikonal::DenseBlock& block = cache.around(start);
    const Vec3d origin = block.origin().asVec3d();
    const eikonal::Foot foot = eikonal::closestPoint(block, query - origin, start - origin);
    const double known = (query - start).length();
    return voxelSize_ * (foot.converged ? std::min(foot.distance, known) : known);
  }

 private:
  struct Points {
    FloatTree::ConstPtr field;
    eikonal::SurfacePoints points;
  };
  static Points pointsOf(FloatTree::ConstPtr field) {
    eikonal::SurfacePoints points = eikonal::findSurfacePoints(*field, {}, {});
    if (!points.thin) return {field, std::move(points)};
    field = eikonal::thicken(*field);
    return {field, eikonal::findSurfacePoints(*field, {}, {})};
  }
  ZeroSet(const FloatGrid& grid, Points found)
      : field_(std::move(found.field)),
        points_(std::move(found.points)),
        tree_(points_.positions),
        transform_(grid.transformPtr()),
        voxelSize_(grid.voxelSize()[0]) {}

  FloatTree::ConstPtr field_;
  eikonal::SurfacePoints points_;
  eikonal::PointTree tree_;
  openvdb::math::Transform::ConstPtr transform_;
  double voxelSize_;
};

struct DistanceSums {
  double largest = 0, weighted = 0, area = 0;
};

DistanceSums distancesTo(const ZeroSet& target, const NarrowBand& solid, const Progress& progress) {
  constexpr std::size_t kChunk = 2048, kBatch = 32;
  const IndexMesh mesh = marchCells(CellSurface(vdb(solid)));
  const CurvedSurface surface(mesh, vdb(solid));
  const openvdb::math::Transform& transform = vdb(solid).transform();
  std::vector<DistanceSums> parts((mesh.triangles.size() + kChunk - 1) / kChunk);
  for (std::size_t begin = 0; begin < parts.size(); begin += kBatch) {
    tbb::parallel_for(begin, std::min(parts.size(), begin + kBatch), [&](std::size_t chunk) {
      CurvedSurface::Cache own = surface.makeCache();
      ZeroSet::Cache other = target.makeCache();
      const std::size_t end = std::min(mesh.triangles.size(), (chunk + 1) * kChunk);
      for (std::size_t i = chunk * kChunk; i < end; ++i) {
        const CurvedSurface::Sample sample = surface.middle(i, own);
        const double distance = target.distance(transform.indexToWorld(sample.position), other);
        parts[chunk].largest = std::max(parts[chunk].largest, distance);
        parts[chunk].weighted += distance * sample.area;
        parts[chunk].area += sample.area;
      }
    });
    report(progress, static_cast<double>(begin) / static_cast<double>(parts.size()), "compare");
  }
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
  report(options.progress, 0, "compare");
  for (const NarrowBand* solid : {&a, &b})
    if (solid->isEmpty())
      throw InvalidInput(fmt::format(
          "compare: the {} solid is empty, so there is no surface to compare; give two solids",
          solid == &a ? "first" : "second"));
  const ZeroSet surfaceA(a), surfaceB(b);
  if (surfaceA.isEmpty() || surfaceB.isEmpty())
    throw InvalidInput(fmt::format(
        "compare: the {} solid has no zero crossing, so there is no surface to compare; give two "
        "solids",
        surfaceA.isEmpty() ? "first" : "second"));
  const DistanceSums fromA = distancesTo(surfaceB, a, subProgress(options.progress, 0.1, 0.5));
  const DistanceSums fromB = distancesTo(surfaceA, b, subProgress(options.progress, 0.5, 0.9));
  Comparison result;
  result.hausdorffAtoB = fromA.largest;
  result.hausdorffBtoA = fromB.largest;
  result.meanAtoB = fromA.weighted / fromA.area;
  result.meanBtoA = fromB.weighted / fromB.area;
  result.symmetricDifference = volumeOfDifference(a, b);
  report(options.progress, 1, "compare");
  return result;
}

}  // namespace levelset
