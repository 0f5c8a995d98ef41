#include "levelset/deform/deform_band.h"

#include <fmt/core.h>
#include <openvdb/tools/Morphology.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "levelset/deform/creases/fit_creases.h"
#include "levelset/deform/creases/restore_creases.h"
#include "levelset/distance/redistance.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/grids/crease_limiter.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/grids/interpolate_vdb.h"
#include "levelset/inspect/crease_patches.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/meshing/extended/extended_surface.h"
#include "levelset/meshing/world_mesh.h"
#include "levelset/transform/resample_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using DeformLeaf = FloatTree::LeafNodeType;

/// Grid points on each side of the surface that get a value: those that redistance() reads.
constexpr int kSampledLayers = 4;
/// Width of the certified domain beside the surface, voxels of the result, where nothing shrinks.
constexpr double kDomainLayers = kSampledLayers + 1;
/// Angle by which the surface turns at a crease. A smooth one turns by less than that over 2.5
/// voxels if its radius of curvature is at least 3.6 voxels.
constexpr double kCreaseDegrees = 40;
/// Voxels that thicken() adds to a band on each side when called twice.
constexpr double kThickenedTwice = 4;

/// Triangles of the zero set before and after the deformation, the latter in index space of the
/// target.
struct DeformedSurface {
  TriMesh before;
  std::vector<V3d> after;
  double leastStretch = 1;  ///< least singular value of the Jacobian at the vertices
};

DeformedSurface deformSurface(const NarrowBand& solid, const Deformation& deformation,
                              double voxelSize) {
  DeformedSurface surface{bandToMesh(solid), {}, std::numeric_limits<double>::infinity()};
  const std::size_t count = surface.before.positions.size();
  surface.after.resize(count);
  std::vector<double> stretches(count);
  deformation.requireDefined(surface.before.positions, "the surface point");
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
    for (std::size_t n = range.begin(); n != range.end(); ++n) {
      const DeformationJet jet = deformation.jet(surface.before.positions[n]);
      surface.after[n] = jet.position / voxelSize;
      Eigen::Matrix3d jacobian;
      for (int axis = 0; axis < 3; ++axis)
        for (int c = 0; c < 3; ++c)
          jacobian(c, axis) = jet.slopes[static_cast<std::size_t>(axis)][c];
      stretches[n] = jacobian.jacobiSvd().singularValues()[2];
    }
  });
  for (const double s : stretches) surface.leastStretch = std::min(surface.leastStretch, s);
  for (const V3d& p : surface.after)
    for (int axis = 0; axis < 3; ++axis)
      if (!(std::abs(p[axis]) < kIndexLimit))
        throw ResourceLimit(fmt::format(
            "the grid index {:.3g} of the result exceeds 32 bits; use larger voxels", p[axis]));
  return surface;
}

/// Checks, before the band of the operand is widened, that a voxel is no larger than the longest
/// side of the deformed surface.
void requireSmallerThanResult(const DeformedSurface& surface, double voxelSize) {
  Imath::Box3d box;
  for (const V3d& p : surface.after) box.extendBy(p);
  const V3d size = box.size();
  const double longest = std::max({size.x, size.y, size.z});
  if (longest >= 1) return;
  throw InvalidInput(fmt::format(
      "voxels of {} are larger than the longest side of the deformed solid, {:.3g}; use smaller "
      "voxels",
      voxelSize, longest * voxelSize));
}

/// Index box of a deformed triangle.
openvdb::CoordBBox indexBoxOf(const DeformedSurface& surface, std::size_t triangle) {
  Imath::Box3d box;
  for (const std::uint32_t n : surface.before.triangles[triangle]) box.extendBy(surface.after[n]);
  return {Coord::floor(toVdb(box.min)), Coord::ceil(toVdb(box.max))};
}

/// Grid points to sample, and for each leaf that contains some a vertex nearby.
struct SampledPart {
  openvdb::MaskTree mask;
  std::map<Coord, std::uint32_t> guesses;
};

SampledPart sampledPart(const DeformedSurface& surface, std::size_t maxMemory) {
  SampledPart part;
  for (std::size_t t = 0; t < surface.before.triangles.size(); ++t) {
    openvdb::CoordBBox box = indexBoxOf(surface, t);
    part.mask.fill(box, true);
    box.expand(kSampledLayers + 1);
    const Coord first = box.min() & ~7, last = box.max() & ~7;
    Coord c;
    for (c[0] = first[0]; c[0] <= last[0]; c[0] += 8)
      for (c[1] = first[1]; c[1] <= last[1]; c[1] += 8)
        for (c[2] = first[2]; c[2] <= last[2]; c[2] += 8)
          part.guesses.try_emplace(c, surface.before.triangles[t][0]);
    if (t % 4096 == 0)
      requireMemory(2.0 * 2300 * static_cast<double>(part.guesses.size()), maxMemory);
  }
  part.mask.voxelizeActiveTiles();
  openvdb::tools::dilateActiveValues(part.mask, kSampledLayers, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::EXPAND_TILES);
  part.mask.voxelizeActiveTiles();
  return part;
}

/// Samples a solid at world positions, as resampleField() does.
class SolidSampler {
 public:
  /// @param scale  factor from source values to distances of the target
  SolidSampler(const NarrowBand& solid, double width, double scale, std::size_t maxMemory,
               const Progress& progress)
      : scale_(scale) {
    NarrowBand wide = solid;
    if (solid.halfWidth() + kThickenedTwice < width || solid.halfWidth() < 2)
      wide = redistance(solid, {.halfWidth = std::max(width - kThickenedTwice, 3.0),
                                .maxMemory = maxMemory,
                                .progress = progress});
    const FloatGrid& grid = vdb(wide);
    transform_ = grid.transformPtr();
    source_ = FloatGrid::create(eikonal::thicken(*eikonal::thicken(grid.tree())));
    creaseBend_ = static_cast<float>(kCreaseBend * solid.voxelSize());
  }

  [[nodiscard]] FloatGrid::ConstAccessor accessor() const { return source_->getConstAccessor(); }

  /// Returns the value, in distances of the target; infinite, with the sign of the solid, beyond
  /// the band.
  [[nodiscard]] double valueAt(const V3d& world, const FloatGrid::ConstAccessor& accessor) const {
    const openvdb::Vec3d p = transform_->worldToIndex(toVdb(world));
    SampleBlock<4> block(accessor, p);
    if (!block.touches(source_->background())) {
      limitAtCreases(block.values, creaseBend_);
      return block.value() * scale_;
    }
    const SampleBlock<2> cell(accessor, p);
    if (!cell.touches(source_->background())) return cell.value() * scale_;
    return std::copysign(std::numeric_limits<double>::infinity(),
                         static_cast<double>(accessor.getValue(Coord::round(p))));
  }

 private:
  double scale_;
  FloatGrid::Ptr source_;
  openvdb::math::Transform::ConstPtr transform_;
  float creaseBend_ = 0;
};

void fillValues(FloatGrid& target, const SampledPart& part, const DeformedSurface& surface,
                const DeformationInverse& inverse, const SolidSampler& sampler,
                const Progress& progress) {
  const double voxelSize = target.voxelSize()[0];
  const float background = target.background();
  openvdb::tree::LeafManager<FloatTree> leaves(target.tree());
  report(progress, 0);
  leaves.foreach ([&](DeformLeaf& leaf, std::size_t) {
    const auto accessor = sampler.accessor();
    V3d guess = surface.before.positions[part.guesses.at(leaf.origin())];
    for (auto it = leaf.beginValueOn(); it; ++it) {
      const V3d position = toImath(it.getCoord().asVec3d()) * voxelSize;
      const auto found = inverse.near(position, guess);
      // A position that no point maps to is outside: the solid lies in the box.
      double value = background;
      if (found) {
        value = sampler.valueAt(*found, accessor);
        guess = *found;
      }
      it.setValue(std::clamp(static_cast<float>(value), -background, background));
    }
  });
  report(progress, 1);
}

/// Gives all other grid points the sign of their neighbours, and ends the band.
void finishSigns(FloatGrid& target) {
  const float background = target.background();
  openvdb::tools::signedFloodFill(target.tree());
  openvdb::tree::LeafManager<FloatTree> leaves(target.tree());
  leaves.foreach ([&](DeformLeaf& leaf, std::size_t) {
    for (auto it = leaf.beginValueOn(); it; ++it)
      if (!(std::abs(*it) < background)) it.setValueOff();
  });
}

/// Edges between curved faces, which redistance() rounds, from the deformed mesh with sharp edges.
NarrowBand withSharpEdges(NarrowBand band, const NarrowBand& solid, const Deformation& deformation,
                          std::size_t maxMemory, const Progress& progress) {
  const FloatGrid& grid = vdb(solid);
  const CellSurface cells(grid);
  const EdgeCrossings crossings = crossingsOfField(cells, grid);
  ExtendedSurface surface =
      extendedSurface(cells, crossings, subProgress(progress, 0, 0.2), /*listsCrossings=*/true);
  if (surface.edgeVertices + surface.cornerVertices == 0) return band;
  const CreasePatches patches(surface, crossings, grid);
  CreasedMesh creased{patches.divided(), {}};
  creased.creases = creaseEdges(solid, toWorld(creased, solid), kCreaseDegrees);
  // Slivers beside a crease turn by any angle.
  std::erase_if(creased.creases, [isFeature = patches.features()](const auto& edge) {
    return !isFeature[edge[0]] || !isFeature[edge[1]];
  });
  if (creased.creases.empty()) return band;
  creased = fitCreases(std::move(creased), grid, maxMemory, subProgress(progress, 0.2, 0.4));
  const auto creases = std::move(creased.creases);
  TriMesh mesh = toWorld(std::move(creased), solid);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.positions.size(), 256),
                    [&](const auto& range) {
                      for (std::size_t n = range.begin(); n != range.end(); ++n)
                        mesh.positions[n] = deformation.at(mesh.positions[n]);
                    });
  mesh.spacing = coordinateSpacing(mesh);
  return restoreCreases(band, mesh, creases,
                        {.maxMemory = maxMemory, .progress = subProgress(progress, 0.4, 1)});
}

}  // namespace

DeformBandResult deformBand(const NarrowBand& solid, const Deformation& deformation,
                            const DeformBandOptions& options) {
  requireSolid(solid);
  if (solid.isEmpty()) throw InvalidInput("the solid is empty; give a solid with a surface");
  const double voxelSize = options.voxelSize.value_or(solid.voxelSize()),
               halfWidth = options.halfWidth.value_or(solid.halfWidth());
  requireVoxelSize(voxelSize);
  if (!(halfWidth >= 1) || !std::isfinite(halfWidth))
    throw UsageError(fmt::format("the half width is {} voxels; give at least 1", halfWidth));
  DeformBandResult result;
  const DeformedSurface surface = deformSurface(solid, deformation, voxelSize);
  const CertifiedDeformation certified = deformation.certify(
      {surface.before.positions, surface.before.triangles,
       voxelSize * std::min(kDomainLayers / std::clamp(surface.leastStretch, 1e-3, 1.0),
                            kWidestDeformationDomain)},
      {.maxMemory = options.maxMemory, .progress = subProgress(options.progress, 0, 0.2)});
  result.certificate = certified.certificate;
  requireInjective(result.certificate);
  if (deformation.isIdentity() && voxelSize == solid.voxelSize() &&
      halfWidth == solid.halfWidth()) {
    result.band = solid;
    return result;
  }
  requireSmallerThanResult(surface, voxelSize);
  report(options.progress, 0.2);
  const SampledPart part = sampledPart(surface, options.maxMemory);
  report(options.progress, 0.25);
  const double ratio = voxelSize / (solid.voxelSize() * std::max(surface.leastStretch, 1e-3));
  const SolidSampler sampler(solid, sampledWidth(ratio), surface.leastStretch, options.maxMemory,
                             subProgress(options.progress, 0.25, 0.4));
  const FloatGrid::Ptr target =
      emptyLevelSet(transformOf(axisAligned(voxelSize)), std::max(halfWidth, 1.0 * kSampledLayers));
  target->tree().topologyUnion(part.mask);
  fillValues(*target, part, surface, *certified.inverse, sampler,
             subProgress(options.progress, 0.4, 0.6));
  finishSigns(*target);
  if (!hasInside(*target))
    throw InvalidInput(fmt::format(
        "no grid point lies inside the deformed solid, because voxels of {} are too large; use "
        "smaller voxels",
        voxelSize));
  NarrowBand smooth =
      redistance(makeBand(target), {.halfWidth = halfWidth,
                                    .maxMemory = options.maxMemory,
                                    .progress = subProgress(options.progress, 0.6, 0.8)});
  result.band = withSharpEdges(std::move(smooth), solid, deformation, options.maxMemory,
                               subProgress(options.progress, 0.8, 1));
  return result;
}

}  // namespace levelset
