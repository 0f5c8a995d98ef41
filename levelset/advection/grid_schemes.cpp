#include "levelset/advection/grid_schemes.h"

#include <fmt/core.h>
#include <openvdb/tools/Morphology.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "levelset/advection/characteristic.h"
#include "levelset/distance/distance_transform.h"
#include "levelset/distance/surface/interpolant.h"
#include "levelset/error.h"
#include "levelset/hamilton_jacobi/upwind_derivative.h"
#include "levelset/vdb.h"

namespace levelset::flow {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Index;
using LeafNode = FloatTree::LeafNodeType;

// Semi-Lagrangian: limits of a step. Length of a characteristic (path of a grid point) in voxels,
// and strain: the norm of the velocity gradient times the step.
constexpr double kFarthestFoot = 4, kFootStrain = 0.5;
// Half width of the working band of the semi-Lagrangian scheme, voxels. The interpolation stencils
// of all grid points beside the zero set, and those of the distance transform that follows, then
// contain no background values.
constexpr double kFootWidth = 5;
// Upwind: Courant number of a step, travel of the surface before the band is redistanced, and half
// width of the working band, both in voxels. The band must contain the stencils after the travel.
constexpr double kCfl = 0.5, kUpwindTravel = 1.5, kUpwindWidth = 6;

std::vector<LeafNode*> leavesOf(FloatTree& tree) {
  std::vector<LeafNode*> leaves;
  tree.getNodes(leaves);
  return leaves;
}

V3d positionOf(const LeafNode& leaf, Index n) {
  return toImath(leaf.offsetToGlobalCoord(n).asVec3d());
}

/// Returns the longest allowed step, units of time: the minimum of `limit`, a function of an index
/// position, over the active grid points.
template <typename Limit>
double longestStep(FloatGrid& grid, const Limit& limit) {
  const std::vector<LeafNode*> leaves = leavesOf(grid.tree());
  std::vector<double> least(leaves.size(), HUGE_VAL);
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    for (auto it = leaves[i]->cbeginValueOn(); it; ++it)
      least[i] = std::min(least[i], limit(positionOf(*leaves[i], it.pos())));
  });
  double result = HUGE_VAL;
  for (const double value : least) result = std::min(result, value);
  return result;
}

FloatGrid::Ptr distanceOf(const FloatGrid& field, double halfWidth, const TimeInterval& interval) {
  eikonal::DistanceRequest request;
  request.halfWidth = halfWidth;
  request.maxMemory = interval.maxMemory;
  return eikonal::distanceTransform(field, request);
}

// === Semi-Lagrangian

// Largest error of a foot point, voxels. A characteristic with a larger error is integrated in two
// halves, recursively to a depth of kMostHalvings.
constexpr double kFootError = 1e-3;
constexpr int kMostHalvings = 6;

V3d footOf(const TimeInterval& interval, const V3d& position, double from, double to,
           int halvings = 0) {
  const Characteristic path(interval.velocity, position, from, to);
  if (!path.isFinite()) requireFinitePath(interval, position, from, to);
  if (!(path.error.length() > kFootError) || halvings == kMostHalvings) return position + path.move;
  const double middle = from + (to - from) / 2;
  return footOf(interval, footOf(interval, position, from, middle, halvings + 1), middle, to,
                halvings + 1);
}

FloatGrid::Ptr semiLagrangianStep(const FloatGrid& before, const TimeInterval& interval,
                                  double from, double to) {
  const FloatGrid::Ptr after = before.deepCopy();
  openvdb::tools::dilateActiveValues(after->tree(), static_cast<int>(kFarthestFoot) + 1,
                                     openvdb::tools::NN_FACE_EDGE, openvdb::tools::IGNORE_TILES);
  const std::vector<LeafNode*> leaves = leavesOf(after->tree());
  tbb::enumerable_thread_specific<eikonal::DenseBlockCache> caches(
      [&] { return eikonal::DenseBlockCache(before.tree()); });
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    eikonal::DenseBlockCache& cache = caches.local();
    for (auto it = leaves[i]->beginValueOn(); it; ++it) {
      const openvdb::Vec3d foot =
          toVdb(footOf(interval, positionOf(*leaves[i], it.pos()), to, from));
      const eikonal::DenseBlock& block = cache.around(foot);
      it.setValue(static_cast<float>(block.jet(foot - block.origin().asVec3d()).value));
    }
  });
  return after;
}

// === Upwind

/// Returns the upwind derivative of φ along an axis, voxels per voxel. The sign of `speed` selects
/// the side.
double upwindSlope(const eikonal::DenseBlock& block, const Coord& c, int axis, double speed,
                   double voxelSize, int order) {
  const int side = speed > 0 ? -1 : 1;
  std::array<double, 6> values;
  for (int k = 0; k < 6; ++k) {
    Coord at = c;
    at[axis] += side * (3 - k);
    values[static_cast<std::size_t>(k)] =
        static_cast<double>(block.at(at[0], at[1], at[2])) / voxelSize;
  }
  return -side * upwindDerivative(values, order);
}

/// Computes result = share · start + (1 − share) · (field − dt u·∇field) on the active grid points,
/// with the velocity u at `time`.
void eulerStage(const FloatGrid& start, const FloatGrid& field, double share, double time,
                double dt, const TimeInterval& interval, int order, FloatGrid& result) {
  const std::vector<LeafNode*> leaves = leavesOf(result.tree());
  const double h = result.voxelSize()[0], background = static_cast<double>(result.background());
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    const FloatGrid::ConstAccessor accessor(field.tree());
    const LeafNode* first = start.tree().probeConstLeaf(leaves[i]->origin());
    eikonal::DenseBlock block;
    block.load(accessor, leaves[i]->origin());
    for (auto it = leaves[i]->beginValueOn(); it; ++it) {
      const Coord c = LeafNode::offsetToLocalCoord(it.pos());
      const V3d speed = interval.velocity(positionOf(*leaves[i], it.pos()), time);
      requireFinite(interval, speed, positionOf(*leaves[i], it.pos()), time);
      double slope = 0;
      for (int axis = 0; axis < 3; ++axis)
        if (speed[axis] != 0)
          slope += speed[axis] * upwindSlope(block, c, axis, speed[axis] * dt, h, order);
      const double moved = static_cast<double>(block.at(c[0], c[1], c[2])) - dt * slope * h;
      const double value =
          share * static_cast<double>(first->getValue(it.pos())) + (1 - share) * moved;
      it.setValue(
          static_cast<float>(std::clamp(value, -background + 1e-6 * h, background - 1e-6 * h)));
    }
  });
}

}  // namespace

void requireOrders(const UpwindOrders& orders) {
  if (std::find(std::begin(kUpwindOrders), std::end(kUpwindOrders), orders.space) ==
      std::end(kUpwindOrders))
    throw UsageError(
        fmt::format("the upwind scheme has no order {} in space; give 1, 2, 3 or 5", orders.space));
  if (orders.time < 1 || orders.time > 3)
    throw UsageError(
        fmt::format("the upwind scheme has no order {} in time; give 1, 2 or 3", orders.time));
}

std::size_t advectSemiLagrangian(NarrowBand& band, const TimeInterval& interval) {
  const double halfWidth = band.halfWidth(), width = std::max(halfWidth, kFootWidth);
  FloatGrid::Ptr grid =
      width > halfWidth ? distanceOf(vdb(band), width, interval) : vdb(band).deepCopy();
  const auto longest = [&](double time) {
    return longestStep(*grid, [&](const V3d& p) {
      const V3d speed = interval.velocity(p, time);
      requireFinite(interval, speed, p, time);
      double strain = 0;
      for (int axis = 0; axis < 3; ++axis) {
        V3d q = p;
        q[axis] += 1;
        strain += (interval.velocity(q, time) - speed).length2();
      }
      return std::min(kFarthestFoot / speed.length(), kFootStrain / std::sqrt(strain));
    });
  };
  const std::size_t steps = integrate(interval, longest, [&](double from, double to) {
    grid = distanceOf(*semiLagrangianStep(*grid, interval, from, to), width, interval);
  });
  if (steps > 0) band = makeBand(width > halfWidth ? distanceOf(*grid, halfWidth, interval) : grid);
  return steps;
}

FloatGrid::Ptr upwindStep(const FloatGrid& start, const TimeInterval& interval,
                          const UpwindOrders& orders, double from, double to) {
  const double dt = to - from;
  const auto stage = [&](const FloatGrid& field, double share, double time) {
    FloatGrid::Ptr result = start.deepCopy();
    eulerStage(start, field, share, time, dt, interval, orders.space, *result);
    return result;
  };
  const FloatGrid::Ptr one = stage(start, 0, from);
  if (orders.time == 1) return one;
  if (orders.time == 2) return stage(*one, 0.5, to);
  const FloatGrid::Ptr two = stage(*one, 0.75, to);
  return stage(*two, 1.0 / 3, from + dt / 2);
}

std::size_t advectUpwind(NarrowBand& band, const TimeInterval& interval,
                         const UpwindOrders& orders) {
  const double halfWidth = band.halfWidth();
  FloatGrid::Ptr grid = distanceOf(vdb(band), std::max(halfWidth, kUpwindWidth), interval);
  double travelled = 0, fastest = 0;
  const auto longest = [&](double time) {
    const double step = longestStep(*grid, [&](const V3d& p) {
      const V3d speed = interval.velocity(p, time);
      requireFinite(interval, speed, p, time);
      return kCfl / (std::abs(speed.x) + std::abs(speed.y) + std::abs(speed.z));
    });
    fastest = std::max(fastest, kCfl / step);
    return step;
  };
  const std::size_t steps = integrate(interval, longest, [&](double from, double to) {
    grid = upwindStep(*grid, interval, orders, from, to);
    travelled += std::abs(to - from) * fastest;
    fastest = 0;
    if (travelled < kUpwindTravel) return;
    grid = distanceOf(*grid, std::max(halfWidth, kUpwindWidth), interval);
    travelled = 0;
  });
  if (steps > 0) band = makeBand(distanceOf(*grid, halfWidth, interval));
  return steps;
}

}  // namespace levelset::flow
