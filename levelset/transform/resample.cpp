#include "levelset/transform/resample.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tree/LeafManager.h>
#include <openvdb/tree/NodeManager.h>
#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/distance/redistance.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/grids/crease_limiter.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/grids/interpolate_vdb.h"
#include "levelset/transform/resample_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using Leaf = FloatTree::LeafNodeType;

const double kCubeDiagonal = std::sqrt(3.0);
/// Largest distance from a position to a sample that tricubic interpolation reads, voxels of the
/// source.
const double kTricubicReach = 2 * kCubeDiagonal;
/// Distance from the surface within which re-distancing reads values, voxels of the target: two
/// grid points on each side of the surface, and the samples around these points.
constexpr double kReadReach = 3.5;
/// Voxels that supported() adds to the source band on each side, by thickening it twice.
constexpr double kThickened = 4;

/// Matrices between index positions in the target and the source grid, and the factor from source
/// values to distances in the target.
struct Placement {
  Imath::M44d targetToSource, sourceToTarget;
  /// Factor from source values to target distances: the smallest stretch of the transform applied
  /// to the solid, so that a scaled value is at most the distance.
  double scale;
  double targetVoxel;  ///< voxel size of the target, world units
  double sourceVoxel;  ///< smallest voxel size of the source, world units

  [[nodiscard]] Vec3d toSource(const Vec3d& target) const { return map(targetToSource, target); }
  [[nodiscard]] Vec3d toTarget(const Vec3d& source) const { return map(sourceToTarget, source); }

 private:
  static Vec3d map(const Imath::M44d& matrix, const Vec3d& p) {
    Imath::V3d result;
    matrix.multVecMatrix(toImath(p), result);
    return toVdb(result);
  }
};

class ResampleKernel {
 public:
  ResampleKernel(const FloatGrid& source, FloatGrid& target, const Placement& placement)
      : source_(source),
        target_(target),
        placement_(placement),
        creaseBend_(static_cast<float>(kCreaseBend * placement.sourceVoxel / placement.scale)) {}

  /// Adds the leaves of the target that can contain voxels of the target's band: those near a leaf
  /// of the source.
  void addLeaves() {
    std::vector<const Leaf*> leaves;
    source_.tree().getNodes(leaves);
    std::vector<std::vector<Coord>> found(leaves.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16),
                      [&](const auto& range) {
                        const auto accessor = source_.getConstAccessor();
                        for (std::size_t i = range.begin(); i != range.end(); ++i)
                          found[i] = blocksNear(*leaves[i], accessor);
                      });
    std::size_t count = 0;
    for (const auto& part : found) count += part.size();
    std::vector<Coord> origins;
    origins.reserve(count);
    for (const auto& part : found) origins.insert(origins.end(), part.begin(), part.end());
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());
    for (const Coord& origin : origins) target_.tree().touchLeaf(origin);
  }

  void fillLeaves() {
    openvdb::tree::LeafManager<FloatTree> leaves(target_.tree());
    leaves.foreach ([this](Leaf& leaf, std::size_t) {
      const auto accessor = source_.getConstAccessor();
      for (openvdb::Index n = 0; n < Leaf::SIZE; ++n)
        fillVoxel(leaf, n, placement_.toSource(leaf.offsetToGlobalCoord(n).asVec3d()), accessor);
    });
  }

  /// Sets the signs of the target's tiles. A tile never contains the surface, so the sign at its
  /// centre suffices.
  void fillTiles() {
    openvdb::tree::NodeManager<FloatTree, FloatTree::RootNodeType::LEVEL - 1> nodes(target_.tree());
    nodes.foreachTopDown([this](auto& node, std::size_t = 0) { fillTilesOf(node); });
  }

 private:
  using Accessor = FloatGrid::ConstAccessor;

  [[nodiscard]] std::vector<Coord> blocksNear(const Leaf& leaf, const Accessor& accessor) const {
    Vec3d low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
    const openvdb::CoordBBox box = leaf.getNodeBoundingBox();
    for (int i = 0; i < 8; ++i) {
      // One voxel more on each side, because interpolation cells extend over the faces of the leaf.
      const Vec3d corner((i & 4) ? box.max()[0] + 1 : box.min()[0] - 1,
                         (i & 2) ? box.max()[1] + 1 : box.min()[1] - 1,
                         (i & 1) ? box.max()[2] + 1 : box.min()[2] - 1);
      const Vec3d p = placement_.toTarget(corner);
      low = openvdb::math::minComponent(low, p);
      high = openvdb::math::maxComponent(high, p);
    }
    Coord first, last;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(std::max(std::abs(low[axis]), std::abs(high[axis])) < kIndexLimit)) {
        throw ResourceLimit(
            fmt::format("the grid index {:.3g} of the result exceeds 32 bits; use larger voxels",
                        std::max(std::abs(low[axis]), std::abs(high[axis]))));
      }
      first[axis] = static_cast<int>(std::floor(low[axis])) & ~7;
      last[axis] = static_cast<int>(std::ceil(high[axis])) & ~7;
    }
    std::vector<Coord> result;
    for (int x = first[0]; x <= last[0]; x += 8)
      for (int y = first[1]; y <= last[1]; y += 8)
        for (int z = first[2]; z <= last[2]; z += 8)
          if (isNearBand(Coord(x, y, z), accessor)) result.emplace_back(x, y, z);
    return result;
  }

  /// Decides, from the distance at the block's centre and its Lipschitz bound, if a block of the
  /// target can contain voxels of the target's band.
  [[nodiscard]] bool isNearBand(const Coord& origin, const Accessor& accessor) const {
    const Vec3d p = placement_.toSource(origin.asVec3d() + Vec3d(3.5));
    const Coord cell = Coord::round(p);
    // The distance changes by at most the length from the source voxel `cell` to the block's
    // centre.
    const double offset = (p - cell.asVec3d()).length() * placement_.sourceVoxel;
    const double here = std::abs(static_cast<double>(accessor.getValue(cell))) * placement_.scale;
    const double halfDiagonal = 3.5 * kCubeDiagonal * placement_.targetVoxel;
    return here - offset - halfDiagonal < static_cast<double>(target_.background());
  }

  void fillVoxel(Leaf& leaf, openvdb::Index n, const Vec3d& p, const Accessor& accessor) const {
    const float background = target_.background();
    const auto take = [&](double sample) {
      const auto value = static_cast<float>(sample * placement_.scale);
      if (std::abs(value) < background)
        leaf.setValueOn(n, value);
      else
        leaf.setValueOff(n, std::copysign(background, value));
    };
    // For most grid points of a target leaf, the nearest source value alone shows that they are
    // outside the band.
    const Coord nearest = Coord::round(p);
    const double offset = (p - nearest.asVec3d()).length() * placement_.sourceVoxel;
    const float sample = accessor.getValue(nearest);
    if (std::abs(static_cast<double>(sample)) * placement_.scale >
        1.1 * (static_cast<double>(background) + offset)) {
      leaf.setValueOff(n, std::copysign(background, sample));
      return;
    }
    const SampleBlock<2> cell(accessor, p);
    if (cell.touches(source_.background())) {
      leaf.setValueOff(n, signAt(p, accessor));
      return;
    }
    SampleBlock<4> block(accessor, p);
    if (block.touches(source_.background())) {
      take(cell.value());
      return;
    }
    limitAtCreases(block.values, creaseBend_);
    take(block.value());
  }

  /// Target background with the sign of the source value nearest to `p`, for positions at or beyond
  /// the end of the source band.
  [[nodiscard]] float signAt(const Vec3d& p, const Accessor& accessor) const {
    return std::copysign(target_.background(), accessor.getValue(Coord::round(p)));
  }

  void fillTilesOf(FloatTree::RootNodeType& root) const {
    for (auto it = root.beginValueAll(); it; ++it) it.setValue(signAtCenter(it.getCoord(), 4096));
  }
  template <typename Node>
  void fillTilesOf(Node& node) const {
    const auto accessor = source_.getConstAccessor();
    for (auto it = node.beginValueAll(); it; ++it) {
      const double half = 0.5 * (Node::ChildNodeType::DIM - 1);
      it.setValue(signAt(placement_.toSource(it.getCoord().asVec3d() + Vec3d(half)), accessor));
    }
  }
  [[nodiscard]] float signAtCenter(const Coord& origin, int edge) const {
    return signAt(placement_.toSource(origin.asVec3d() + Vec3d(0.5 * (edge - 1))),
                  source_.getConstAccessor());
  }

  const FloatGrid& source_;
  FloatGrid& target_;
  const Placement& placement_;
  float creaseBend_;
};

Placement placementOf(const NarrowBand& solid, const Imath::M44d& sourceToWorld,
                      const Imath::M44d& targetToWorld) {
  Placement place;
  place.targetToSource = targetToWorld * sourceToWorld.inverse();
  place.sourceToTarget = sourceToWorld * targetToWorld.inverse();
  const Stretch source = stretchOf(sourceToWorld);
  place.scale = source.least / solid.voxelSize();
  place.sourceVoxel = source.least;
  place.targetVoxel = stretchOf(targetToWorld).least;
  return place;
}

/// Extends the source band to the distance that sampling and re-distancing read. The added values
/// are extrapolated; they are inactive and differ from ± background. They only support the
/// interpolation; re-distancing replaces the distances there.
FloatGrid::Ptr supported(const NarrowBand& solid, const Placement& place, std::size_t maxMemory,
                         const Progress& progress) {
  const double needed = sampledWidth(place.targetVoxel / place.sourceVoxel);
  NarrowBand wide = solid;
  if (solid.halfWidth() + kThickened < needed || solid.halfWidth() < 2)
    wide = redistance(solid, {.halfWidth = std::max(needed - kThickened, 3.0),
                              .maxMemory = maxMemory,
                              .progress = progress});
  const FloatGrid& grid = vdb(wide);
  return FloatGrid::create(eikonal::thicken(*eikonal::thicken(grid.tree())));
}

/// Checks the memory estimate before any block is built.
/// @param refinement  number of target voxels along the edge of a source voxel
void checkMemory(const NarrowBand& solid, double refinement, double halfWidth,
                 std::size_t maxMemory) {
  // Estimates the number of source voxels in one layer at the surface, then the leaves of the
  // target. The target exists twice, sampled and re-distanced.
  const double surface = static_cast<double>(solid.activeVoxelCount()) / (2 * solid.halfWidth());
  const double leaves = surface * refinement * refinement / 64 * (2 * halfWidth + 15) / 8;
  requireMemory(leaves * 2 * 2300, maxMemory);
}

/// Checks, before the source band is widened, that a target voxel is no larger than the longest
/// side of the solid.
void requireSmallerVoxels(const NarrowBand& solid, const Imath::M44d& sourceToWorld,
                          const Placement& place) {
  const Imath::V3d size = solid.zeroSetBounds().size();
  const double longest =
      std::max({size.x, size.y, size.z}) / solid.voxelSize() * stretchOf(sourceToWorld).greatest;
  if (place.targetVoxel <= longest) return;
  throw InvalidInput(
      fmt::format("voxels of {} are larger than the longest side of the solid, "
                  "about {:.3g}; use smaller voxels",
                  place.targetVoxel, longest));
}

}  // namespace

Stretch stretchOf(const Imath::M44d& matrix) {
  Eigen::Matrix3d linear;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) linear(i, j) = matrix[i][j];
  const Eigen::Vector3d values = Eigen::JacobiSVD<Eigen::Matrix3d>(linear).singularValues();
  return {values[2], values[0]};
}

openvdb::math::Transform::Ptr transformOf(const Imath::M44d& indexToWorld) {
  const double scale = indexToWorld[0][0];
  if (scale > 0 && indexToWorld == axisAligned(scale)) return uniformTransform(scale);
  // OpenVDB rejects a matrix with a determinant of 3e-15 or less.
  if (!(Imath::M44d(indexToWorld).determinant() > 1e-14)) {
    throw ResourceLimit(
        fmt::format("voxels of {:.3g} are too small for a rotated or "
                    "translated grid; use a smaller unit of length, so that the numbers are larger",
                    stretchOf(indexToWorld).least));
  }
  return openvdb::math::Transform::createLinearTransform(openvdb::math::Mat4d(&indexToWorld[0][0]));
}

Imath::M44d axisAligned(double voxelSize) {
  return Imath::M44d().setScale(voxelSize);
}

void requireVoxelSize(double voxelSize) {
  if (voxelSize > 0 && std::isfinite(voxelSize)) return;
  throw UsageError(fmt::format("the voxel size is {}; give a positive, finite length", voxelSize));
}

NarrowBand resampleField(const NarrowBand& solid, const Imath::M44d& sourceToWorld,
                         const Imath::M44d& targetToWorld, double halfWidth, std::size_t maxMemory,
                         const Progress& progress) {
  requireSolid(solid);
  if (solid.isEmpty()) throw InvalidInput("the solid is empty; give a solid with a surface");
  if (!(halfWidth >= 1) || !std::isfinite(halfWidth)) {
    throw UsageError(fmt::format("the half width is {} voxels; give at least 1", halfWidth));
  }
  const Placement place = placementOf(solid, sourceToWorld, targetToWorld);
  requireSmallerVoxels(solid, sourceToWorld, place);
  checkMemory(solid, stretchOf(sourceToWorld).greatest / place.targetVoxel, halfWidth, maxMemory);
  report(progress, 0);
  const auto target = emptyLevelSet(transformOf(targetToWorld), halfWidth);
  const FloatGrid::Ptr source = supported(solid, place, maxMemory, subProgress(progress, 0, 0.4));
  ResampleKernel kernel(*source, *target, place);
  kernel.addLeaves();
  report(progress, 0.45);
  kernel.fillLeaves();
  kernel.fillTiles();
  report(progress, 0.6);
  if (!hasInside(*target)) {
    throw InvalidInput(
        fmt::format("no grid point lies inside the solid, because voxels of {} are too large; "
                    "use smaller voxels",
                    place.targetVoxel));
  }
  return redistance(
      makeBand(target),
      {.halfWidth = halfWidth, .maxMemory = maxMemory, .progress = subProgress(progress, 0.6, 1)});
}

NarrowBand resampleTo(const NarrowBand& solid, const Imath::M44d& indexToWorld,
                      const ResampleOptions& options) {
  const double halfWidth = options.halfWidth.value_or(solid.halfWidth());
  const Stretch stretch = stretchOf(indexToWorld);
  if (!(stretch.least > 0) || !(stretch.greatest < stretch.least * (1 + 1e-6)) ||
      !(Imath::M44d(indexToWorld).determinant() > 0)) {
    throw InvalidInput(
        "the transform of the new grid shears, mirrors or scales unevenly; "
        "use a rotation, a uniform scale and a translation");
  }
  return resampleField(solid, solid.indexToWorld(), indexToWorld, halfWidth, options.maxMemory,
                       options.progress);
}

double sampledWidth(double ratio) {
  return kReadReach * ratio + kTricubicReach;
}

NarrowBand resample(const NarrowBand& solid, double voxelSize, const ResampleOptions& options) {
  requireVoxelSize(voxelSize);
  return resampleTo(solid, axisAligned(voxelSize), options);
}

NarrowBand resampleLike(const NarrowBand& solid, const NarrowBand& like,
                        const ResampleOptions& options) {
  ResampleOptions chosen = options;
  if (!chosen.halfWidth) chosen.halfWidth = like.halfWidth();
  if (solid.shared() && like.shared() && shareGrid(solid, like)) return solid;
  return resampleTo(solid, like.indexToWorld(), chosen);
}

bool shareGrid(const NarrowBand& a, const NarrowBand& b) {
  return a.shared() && b.shared() && shareTransform(vdb(a), vdb(b)) &&
         vdb(a).background() == vdb(b).background();
}

}  // namespace levelset
