#include "levelset/emboss/emboss.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>

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

/// A point of the old surface near the curve, and its move along the unit normal; index space.
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
    if (std::abs(phi) > 0.1 && std::abs(phi) < 1.5)
      moves.push_back({foot, (it.getCoord().asVec3d() - foot) / phi, relief.section.height(d)});
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
  } catch (const NoSurface&) {
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

/// Distance of a moved point beyond the middle between its own and another part of the old surface,
/// voxels, that is corrected.
constexpr double kMostMiss = 0.1;

/// Returns true when a point moves to where another part of the old surface is nearer than its own.
bool passesMedialAxis(const Field& field, const Relief& relief, double voxel) {
  const auto accessor = field.distances->getConstAccessor();
  const double sign = relief.height < 0 ? -1 : 1;
  return std::any_of(field.moves.begin(), field.moves.end(), [&](const Move& move) {
    const SampleBlock<2> block(accessor, move.from + move.height * move.normal);
    const double away = sign * (block.value() / voxel + field.shift);
    return std::abs(move.height) - away > kMostMiss;
  });
}

/// Calls visit(grid point) for the grid points of a box within one voxel of a line, between the
/// positions `from` and `to`.
template <typename Visit>
void alongLine(const Vec3d& from, const Vec3d& to, const CoordBBox& box, const Visit& visit) {
  const Vec3d along = to - from, size = openvdb::math::Abs(along);
  const int a = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
  const int b = (a + 1) % 3, c = (a + 2) % 3;
  const double low = std::max<double>(box.min()[a], std::floor(std::min(from[a], to[a]))),
               high = std::min<double>(box.max()[a], std::ceil(std::max(from[a], to[a])));
  Coord at;
  for (double k = low; k <= high; ++k) {
    const Vec3d p = from + (k - from[a]) / along[a] * along;
    at[a] = static_cast<int>(k);
    for (int u = -1; u <= 1; ++u)
      for (int v = -1; v <= 1; ++v) {
        at[b] = static_cast<int>(std::round(p[b])) + u;
        at[c] = static_cast<int>(std::round(p[c])) + v;
        const Vec3d off = at.asVec3d() - from;
        const double squared = off.lengthSqr() - std::pow(off.dot(along), 2) / along.lengthSqr();
        if (squared <= 1 && box.isInside(at)) visit(at);
      }
  }
}

/// Continues the moves along their normals beyond the medial axis, into the cells of other parts of
/// the surface. There a grid point has a second position (d, φ): of the line that passes it. Rising
/// joins the two solids that the positions give, sinking intersects them.
void continueMoves(Field& field, const Relief& relief, double voxel, const CoordBBox& box) {
  const double sign = relief.height < 0 ? -1 : 1, background = field.grid->background() / voxel;
  const double limit = relief.width + background + kVisitedSpacing;
  const auto distances = field.distances->getConstAccessor();
  auto accessor = field.grid->getAccessor();
  const auto phiAt = [&](const Coord& c) { return distances.getValue(c) / voxel + field.shift; };
  for (const Move& move : field.moves) {
    const Vec3d end = move.from + (relief.height + sign * background) * move.normal;
    alongLine(move.from, end, box, [&](const Coord& at) {
      const double phi = (at.asVec3d() - move.from).dot(move.normal);
      constexpr double kSlack = 0.25;      // voxels
      constexpr double kSameNormal = 0.9;  // cosine
      if (std::abs(phiAt(at)) > std::abs(phi) + kSlack) return;
      Vec3d gradient;
      for (int axis = 0; axis < 3; ++axis) {
        Coord step(0);
        step[axis] = 1;
        gradient[axis] = (phiAt(at + step) - phiAt(at - step)) / 2;
      }
      if (gradient.dot(move.normal) > kSameNormal) return;  // the foot of the line is the nearest
      const double d = relief.curve.distance(at.asVec3d() - phi * move.normal, limit);
      const auto value = static_cast<float>(
          std::clamp(relief.section.distance(d, phi), -background, background) * voxel);
      if (!(sign * value < sign * accessor.getValue(at))) return;
      if (std::abs(value) < field.grid->background())
        accessor.setValueOn(at, value);
      else
        accessor.setValueOff(at, std::copysign(field.grid->background(), value));
      field.changed.expand(at);
    });
  }
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
  Field field = embossedField(solid, relief, box, options);
  if (!field.isReached) refuseFarCurve(solid, relief, options);
  if (passesMedialAxis(field, relief, voxel)) continueMoves(field, relief, voxel, box);
  if (field.changed.empty()) return keepsBits ? solid : redistanced(solid, options.progress);

  // === Distances to the new surface
  const Progress rest = subProgress(options.progress, 0.5, 1);
  if (!eikonal::hasZeroCrossing(field.grid->tree()))
    throw InvalidInput(
        fmt::format("the result is empty with a height of {}; use a smaller depth", height));
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
