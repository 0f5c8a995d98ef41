#include "levelset/advection/grid_schemes.h"

#include <openvdb/tools/Morphology.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "levelset/advection/characteristic.h"
#include "levelset/distance/distance_transform.h"
#include "levelset/distance/surface/interpolant.h"
#include "levelset/hamilton_jacobi/upwind_stage_vdb.h"
#include "levelset/vdb.h"

namespace levelset::flow {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Index;

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
  const std::vector<BandLeaf*> leaves = leavesOf(after->tree());
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

/// Returns the function u·∇φ of eulerStage(), with the velocity u at `time`.
auto transportAt(const TimeInterval& interval, int order, double dt, double h, double time) {
  return [=, &interval](const StencilBlock& block, const BandLeaf& leaf, const BandAccessor&) {
    return [=, &interval, &block, &leaf](Index offset) {
      const Coord c = BandLeaf::offsetToLocalCoord(offset);
      const V3d position = positionOf(leaf, offset), speed = interval.velocity(position, time);
      requireFinite(interval, speed, position, time);
      double slope = 0;
      for (int axis = 0; axis < 3; ++axis)
        if (speed[axis] != 0)
          slope += speed[axis] * oneSidedSlope(block.at(c[0], c[1], c[2]), axis,
                                               speed[axis] * dt > 0 ? -1 : 1, h, order);
      return slope;
    };
  };
}

}  // namespace

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
  const std::size_t steps = integrate(interval.duration(), longest, [&](double from, double to) {
    grid = distanceOf(*semiLagrangianStep(*grid, interval, from, to), width, interval);
  });
  if (steps > 0) band = makeBand(width > halfWidth ? distanceOf(*grid, halfWidth, interval) : grid);
  return steps;
}

FloatGrid::Ptr upwindStep(const FloatGrid& start, const TimeInterval& interval,
                          const UpwindOrders& orders, double from, double to) {
  return rungeKuttaStep(start, orders.time, from, to, [&](double time) {
    return transportAt(interval, orders.space, to - from, start.voxelSize()[0], time);
  });
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
  const std::size_t steps = integrate(interval.duration(), longest, [&](double from, double to) {
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
