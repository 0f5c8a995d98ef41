#include "levelset/emboss/emboss.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>
#include <tuple>

#include "levelset/distance/distance_transform.h"
#include "levelset/distance/redistance.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/emboss/emboss_curve.h"
#include "levelset/emboss/emboss_section.h"
#include "levelset/error.h"
#include "levelset/grids/grid_queries_vdb.h"
#include "levelset/grids/interpolate_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using embossing::EmbossCurve;
using embossing::EmbossSection;
using embossing::Polyline;
using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::Vec3d;
using EmbossLeaf = openvdb::FloatTree::LeafNodeType;

// Least half width of the field whose zero set is the new surface, voxels.
constexpr double kLeastFieldWidth = 3;
// Largest distance between a spline and its segments, voxels.
constexpr double kSplineTolerance = 0.005;
// Spacing of the visited points of the surface, voxels.
constexpr double kVisitedSpacing = 1;

/// Lengths of an emboss in voxels, and its curve in index space.
struct Relief {
  EmbossCurve curve;
  EmbossSection section;
  double width, height;

  /// Distance from the curve within which values change, voxels.
  [[nodiscard]] double reach(double halfWidth) const {
    return width + std::abs(height) + halfWidth;
  }
};

void checkArguments(const NarrowBand& solid, const EmbossCurveShape& curve, double width,
                    double height, const EmbossOptions& options) {
  if (!std::isfinite(width) || width <= 0)
    throw UsageError(fmt::format("the width is {}; give a length above zero", width));
  if (!std::isfinite(height))
    throw UsageError(fmt::format("the height is {}; give a finite length", height));
  const double halfWidth = options.halfWidth.value_or(kLeastFieldWidth);
  if (!std::isfinite(halfWidth) || halfWidth < 1)
    throw UsageError(fmt::format("the half width is {} voxels; give at least 1", halfWidth));
  if (curve.points.empty()) throw UsageError("the curve has no points; give at least one point");
  for (std::size_t i = 0; i < curve.points.size(); ++i) {
    const Imath::V3d& p = curve.points[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      throw UsageError(fmt::format("point {} of the curve is {},{},{}; give finite coordinates",
                                   i + 1, p.x, p.y, p.z));
  }
  requireSolid(solid);
  if (solid.isEmpty())
    throw InvalidInput("the solid is empty, so there is no surface to emboss; give a solid");
}

EmbossCurve inIndexSpace(const EmbossCurveShape& curve, const FloatGrid& grid) {
  Polyline line{{}, curve.isJoined, curve.isClosed};
  for (const Imath::V3d& p : curve.points) line.points.push_back(grid.worldToIndex(toVdb(p)));
  return EmbossCurve(curve.isSpline ? embossing::onSpline(line, kSplineTolerance) : line);
}

/// Returns the box of the grid points within `reach` voxels of the curve, clipped to a box.
CoordBBox around(const EmbossCurve& curve, double reach, const CoordBBox& within) {
  CoordBBox box = within;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = std::floor(curve.bounds().min()[axis] - reach),
                 high = std::ceil(curve.bounds().max()[axis] + reach);
    box.min()[axis] =
        static_cast<int>(std::clamp<double>(low, within.min()[axis], within.max()[axis]));
    box.max()[axis] =
        static_cast<int>(std::clamp<double>(high, within.min()[axis], within.max()[axis]));
    if (high < within.min()[axis] || low > within.max()[axis]) return {};
  }
  return box;
}

/// A point of the old surface, and its move along the unit normal; index space.
struct Move {
  Vec3d from, normal;
  double height;
};

/// Field near the curve whose zero set is the new surface.
struct Field {
  FloatGrid::Ptr grid;
  FloatGrid::Ptr distances;  ///< distances to the old surface minus `shift`, world units
  double shift = 0;          ///< voxels
  std::vector<Move> moves = {};
  CoordBBox changed = {};
  bool isReached = false;  ///< a point of the old surface is within the width of the curve
};

/// Embosses the values of one leaf. Values that do not change keep their bits.
/// @param distances  distances to the old surface minus the shift
/// @return true if a value of `target` changed
bool embossLeaf(const EmbossLeaf& distances, const eikonal::ClosestPointLeaf& points,
                const Relief& relief, double voxel, Field& shared, EmbossLeaf& target,
                std::vector<Move>& moves, bool& isReached) {
  const float background = shared.grid->background();
  const double limit = relief.width + background / voxel + kVisitedSpacing;
  bool isChanged = false;
  for (auto it = distances.cbeginValueOn(); it; ++it) {
    const Vec3d& foot = points[it.pos()];
    const double d = relief.curve.distance(foot, limit);
    isReached |= d < relief.width + kVisitedSpacing;
    if (d >= limit) continue;
    const double phi = static_cast<double>(*it) / voxel + shared.shift;
    const double height = relief.section.height(d);
    if (height != 0 && std::abs(phi) > 0.1 && std::abs(phi) < 1.5)
      moves.push_back({foot, (it.getCoord().asVec3d() - foot) / phi, height});
    const double value = relief.section.distance(d, phi);
    if (value == phi) continue;
    const auto world = static_cast<float>(value * voxel);
    if (std::abs(world) < background)
      target.setValueOn(it.pos(), world);
    else
      target.setValueOff(it.pos(), std::copysign(background, world));
    isChanged = true;
  }
  return isChanged;
}

Field embossedField(const NarrowBand& solid, const Relief& relief, const CoordBBox& box,
                    const EmbossOptions& options) {
  Field field{vdb(solid).deepCopy(), nullptr, relief.height / 2};
  const double voxel = solid.voxelSize();
  eikonal::DistanceRequest request;
  request.shift = field.shift;
  request.halfWidth = std::abs(field.shift) + solid.halfWidth() + 1;
  request.region = box;
  request.maxMemory = options.maxMemory;
  request.progress = subProgress(options.progress, 0, 0.5);
  std::mutex mutex;
  std::vector<std::unique_ptr<EmbossLeaf>> made;
  request.visitPoints = [&](const EmbossLeaf& leaf, const eikonal::ClosestPointLeaf& points) {
    std::unique_ptr<EmbossLeaf> target;
    const openvdb::FloatTree& before = vdb(solid).tree();
    if (const EmbossLeaf* old = before.probeConstLeaf(leaf.origin()))
      target = std::make_unique<EmbossLeaf>(*old);
    else
      target = std::make_unique<EmbossLeaf>(leaf.origin(), before.getValue(leaf.origin()), false);
    std::vector<Move> moves;
    bool isReached = false;
    const bool isChanged =
        embossLeaf(leaf, points, relief, voxel, field, *target, moves, isReached);
    const std::lock_guard lock(mutex);
    field.moves.insert(field.moves.end(), moves.begin(), moves.end());
    field.isReached |= isReached;
    if (!isChanged) return;
    field.changed.expand(target->getNodeBoundingBox());
    made.push_back(std::move(target));
  };
  try {
    field.distances = eikonal::distanceTransform(vdb(solid), request);
  } catch (const InvalidInput&) {
    return field;  // the surface does not pass through the box
  }
  for (std::unique_ptr<EmbossLeaf>& leaf : made) field.grid->tree().addLeaf(leaf.release());
  return field;
}

[[noreturn]] void refuseFarCurve(const NarrowBand& solid, const Relief& relief,
                                 const EmbossOptions& options) {
  double least = INFINITY;
  std::mutex mutex;
  eikonal::DistanceRequest request;
  request.halfWidth = 1;
  request.maxMemory = options.maxMemory;
  request.visitPoints = [&](const EmbossLeaf& leaf, const eikonal::ClosestPointLeaf& points) {
    double own = INFINITY;
    for (auto it = leaf.cbeginValueOn(); it; ++it)
      own = std::min(own, relief.curve.distance(points[it.pos()], 1e30));
    const std::lock_guard lock(mutex);
    least = std::min(least, own);
  };
  (void)eikonal::distanceTransform(vdb(solid), request);
  const double voxel = solid.voxelSize();
  throw InvalidInput(
      fmt::format("the curve is {:.4g} world units from the surface, but only points within the "
                  "width of {:.4g} move; give a curve on the surface, or a larger width",
                  least * voxel, relief.width * voxel));
}

/// Refuses a height at which a moved point is nearer to an opposite part of the old surface than to
/// its own. The normals of the two parts then differ by more than 120 degrees.
void checkHeight(const Field& field, const Relief& relief, double voxel) {
  constexpr double kLeastMiss = 0.25;  // voxels
  const auto accessor = field.distances->getConstAccessor();
  const double sign = relief.height < 0 ? -1 : 1;
  const Move* worst = nullptr;
  double most = kLeastMiss;
  for (const Move& move : field.moves) {
    const SampleBlock<2> block(accessor, move.from + move.height * move.normal);
    const double away = sign * (block.value() / voxel + field.shift);
    const double miss = std::abs(move.height) - away;
    const bool isOpposite = block.gradient().dot(move.normal) < -0.5 * voxel;
    if (miss < most || !(isOpposite || away <= 0)) continue;
    const auto place = [](const Move& m) {
      return std::tuple(m.from[0], m.from[1], m.from[2], m.height);
    };
    if (worst && miss == most && !(place(move) < place(*worst))) continue;
    most = miss;
    worst = &move;
  }
  if (!worst) return;
  const Vec3d at = field.grid->indexToWorld(worst->from);
  throw InvalidInput(
      fmt::format("at {:.4g},{:.4g},{:.4g} the surface would {} by {:.4g} world units, beyond the "
                  "middle of {}; "
                  "use a smaller height",
                  at[0], at[1], at[2], sign < 0 ? "sink" : "rise", std::abs(worst->height) * voxel,
                  sign < 0 ? "the solid" : "the gap to another part of the surface"));
}

/// Copies distances into the field: at the grid points that the emboss changed, and at those within
/// its reach.
void overlay(FloatGrid& field, const FloatGrid& distances, const FloatGrid& before,
             const Relief& relief, double reach, const CoordBBox& box) {
  std::set<Coord> origins;
  for (const FloatGrid* grid : {static_cast<const FloatGrid*>(&field), &distances})
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf)
      if (box.hasOverlap(leaf->getNodeBoundingBox())) origins.insert(leaf->origin());
  constexpr double kBlockRadius = 6.1;  // from the centre of a block to its corner
  const auto accessor = distances.getConstAccessor(), old = before.getConstAccessor();
  for (const Coord& origin : origins) {
    const EmbossLeaf* known = field.tree().probeConstLeaf(origin);
    const double far = reach + kBlockRadius;
    const bool isNear = relief.curve.distance(origin.asVec3d() + Vec3d(3.5), far) < far;
    if (!known && !isNear) continue;
    EmbossLeaf* target = nullptr;
    for (openvdb::Index n = 0; n < EmbossLeaf::SIZE; ++n) {
      const Coord at = origin + EmbossLeaf::offsetToLocalCoord(n);
      const bool isChanged = known && known->getValue(n) != old.getValue(at);
      if (!isChanged && !(isNear && relief.curve.distance(at.asVec3d(), reach) < reach)) continue;
      if (!box.isInside(at)) continue;
      float value = 0;
      const bool isOn = accessor.probeValue(at, value);
      if (!target) known = target = field.tree().touchLeaf(origin);
      if (isOn)
        target->setValueOn(n, value);
      else
        target->setValueOff(n, value);
    }
  }
}

}  // namespace

NarrowBand emboss(const NarrowBand& solid, const EmbossCurveShape& curve, double width,
                  double height, const EmbossOptions& options) {
  checkArguments(solid, curve, width, height, options);
  const double halfWidth = options.halfWidth.value_or(solid.halfWidth());
  if (solid.halfWidth() < kLeastFieldWidth) {
    EmbossOptions wide = options;
    wide.halfWidth = std::max(halfWidth, kLeastFieldWidth);
    if (height == 0 && halfWidth == solid.halfWidth()) return solid;
    return narrowed(
        emboss(redistance(solid, {.halfWidth = kLeastFieldWidth, .maxMemory = options.maxMemory}),
               curve, width, height, wide),
        halfWidth);
  }
  const auto redistanced = [&](const NarrowBand& band, const Progress& progress) {
    return redistance(
        band, {.halfWidth = halfWidth, .maxMemory = options.maxMemory, .progress = progress});
  };
  const bool keepsBits = halfWidth == solid.halfWidth();
  if (height == 0) return keepsBits ? solid : redistanced(solid, options.progress);

  // === Field whose zero set is the new surface
  const double voxel = solid.voxelSize();
  const Relief relief{inIndexSpace(curve, vdb(solid)),
                      EmbossSection(options.profile, width / voxel, height / voxel), width / voxel,
                      height / voxel};
  CoordBBox grid = vdb(solid).evalActiveVoxelBoundingBox();
  constexpr double kMost = 1e8;
  grid.expand(static_cast<int>(std::min(std::abs(relief.height) + halfWidth + 8, kMost)));
  const double reach = relief.reach(halfWidth) + 2;
  CoordBBox box = around(relief.curve, relief.reach(solid.halfWidth()) + 3, grid);
  if (box.empty()) refuseFarCurve(solid, relief, options);
  const Field field = embossedField(solid, relief, box, options);
  if (!field.isReached) refuseFarCurve(solid, relief, options);
  checkHeight(field, relief, voxel);
  if (field.changed.empty()) return keepsBits ? solid : redistanced(solid, options.progress);

  // === Distances to the new surface
  const Progress rest = subProgress(options.progress, 0.5, 1);
  pruneOneSided(field.grid->tree());
  if (!keepsBits) return redistanced(makeBand(field.grid), rest);
  box = around(relief.curve, reach, grid);
  box.expand(field.changed);
  eikonal::DistanceRequest request;
  request.halfWidth = halfWidth;
  request.region = box;
  request.maxMemory = options.maxMemory;
  request.progress = rest;
  const FloatGrid::Ptr distances = eikonal::distanceTransform(*field.grid, request);
  overlay(*field.grid, *distances, vdb(solid), relief, reach, box);
  pruneOneSided(field.grid->tree());
  return makeBand(field.grid);
}

}  // namespace levelset
