#include "levelset/evolve/evolve.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "levelset/distance/distance_transform.h"
#include "levelset/distance/surface/surface_points.h"
#include "levelset/error.h"
#include "levelset/evolve/front_motion_vdb.h"
#include "levelset/geometry/search/point_search.h"
#include "levelset/hamilton_jacobi/time_steps.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using flow::FrontMotion;
using flow::MotionRates;
using Imath::V3d;
using openvdb::FloatGrid;

// The band is redistanced after this travel of the level sets, voxels, or this diffusion of the
// curvature, voxels². Errors at the edge of the band then stay away from the surface: a diffusion
// of 1 reduces them to erfc(kCurvatureCore / 2) = 2e-4.
constexpr double kMostTravel = 1.5, kMostDiffusion = 1;
// A wave on the surface may grow by this exponent over the motion, where F grows with the curvature
// only by rounding.
constexpr double kMostGrowthExponent = 1e-3;

void checkEvolveOptions(const NarrowBand& solid, double time, const EvolveOptions& options) {
  if (!(time >= 0) || !std::isfinite(time))
    throw UsageError(fmt::format("the time is {}; give a finite time of 0 or more", time));
  if (!std::isfinite(options.start) || !std::isfinite(options.start + time))
    throw UsageError(fmt::format("the start time is {}; give a finite time", options.start));
  if (!(options.cfl > 0 && options.cfl <= 1))
    throw UsageError(
        fmt::format("the Courant number is {}; give one above 0 and at most 1", options.cfl));
  flow::requireOrders({options.order, options.timeOrder});
  if (options.mask) checkMask(*options.mask);
  if (options.near) {
    const PointFalloff& near = *options.near;
    if (near.points.empty() || !(near.radius > 0) || !std::isfinite(near.radius))
      throw UsageError(
          fmt::format("the motion is limited to {} points with a radius of {}; give at least one "
                      "point and a positive, finite radius",
                      near.points.size(), near.radius));
    for (const V3d& p : near.points)
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
        throw UsageError(fmt::format("the point {},{},{} is not finite; give finite coordinates",
                                     p.x, p.y, p.z));
  }
  requireSolid(solid);
  if (solid.isEmpty())
    throw InvalidInput(
        "the solid is empty, so there is no surface to move; give a solid with a surface");
}

/// Weight that falls from 1 at the points of a set to 0 at the distance `radius`.
class FalloffWeight {
 public:
  explicit FalloffWeight(const PointFalloff& falloff)
      : radius_(falloff.radius), tree_(makePointSearch(falloff.points)) {}
  double operator()(const V3d& world) const {
    const FoundItem nearest = tree_.closest(world, radius_ * radius_);
    if (!nearest.isValid()) return 0;
    const double t = std::min(1.0, std::sqrt(nearest.squared) / radius_);
    return 1 - t * t * (3 - 2 * t);
  }

 private:
  double radius_;
  PointSearch tree_;
};

/// Returns the product of mask and falloff; empty: 1 everywhere.
std::function<double(const V3d&)> weightOf(const EvolveOptions& options) {
  std::function<double(const V3d&)> mask, falloff;
  if (options.mask) mask = [&](const V3d& p) { return options.mask->weight(p); };
  if (options.near)
    falloff = [weight = std::make_shared<const FalloffWeight>(*options.near)](const V3d& p) {
      return (*weight)(p);
    };
  if (!mask || !falloff) return mask ? mask : falloff;
  return [mask, falloff](const V3d& p) {
    const double weight = falloff(p);
    return weight == 0 ? 0 : weight * mask(p);
  };
}

/// Memory of a step per active grid point, bytes: four fields, in blocks that are a third active.
constexpr double kStageBytes = 4 * kBytesPerVoxel;

/// The motion of one solid.
class Evolution {
 public:
  Evolution(const NarrowBand& solid, const NormalSpeed& speed, double time,
            const EvolveOptions& options)
      : options_(options),
        motion_({.speed = speed,
                 .weight = weightOf(options),
                 .orders = {options.order, options.timeOrder},
                 .cfl = options.cfl},
                solid.indexToWorld(), solid.voxelSize()),
        voxel_(solid.voxelSize()),
        end_(options.start + time),
        width_(std::max(solid.halfWidth(), motion_.width())) {}

  EvolveResult run(NarrowBand solid) {
    grid_ = distanceTo(vdb(solid), width_);
    requireMemory(kStageBytes * static_cast<double>(grid_->activeVoxelCount()), options_.maxMemory);
    const flow::Duration duration{.from = options_.start,
                                  .to = end_,
                                  .progress = subProgress(options_.progress, 0, 0.99),
                                  .cause = "speed"};
    // A speed of zero at all times needs no steps.
    if (motion_.changesInTime() || std::isfinite(longestStep(options_.start)))
      flow::integrate(
          duration, [&](double at) { return longestStep(at); },
          [&](double from, double to) { step(from, to); });
    if (result_.steps > 0) {
      solid = makeBand(distanceTo(*grid_, solid.halfWidth()));
    } else {
      result_.redistances = 0;
    }
    report(options_.progress, 1);
    result_.band = std::move(solid);
    return std::move(result_);
  }

 private:
  FloatGrid::Ptr distanceTo(const FloatGrid& field, double halfWidth) {
    eikonal::DistanceRequest request;
    request.halfWidth = halfWidth;
    request.maxMemory = options_.maxMemory;
    ++result_.redistances;
    return eikonal::distanceTransform(field, request);
  }

  double longestStep(double time) {
    if (motion_.changesInTime() || !ratesAreCurrent_) {
      const MotionRates rates = motion_.rates(*grid_, time);
      requireWellPosed(rates, time);
      travel_ = std::max(travel_, rates.travel);
      diffusion_ = std::max(diffusion_, rates.diffusion);
      longest_ = rates.step;
      ratesAreCurrent_ = true;
    }
    return longest_;
  }

  void requireWellPosed(const MotionRates& rates, double time) const {
    // The shortest wave on a grid, of two voxels, has the wave number π / voxel.
    const double exponent = M_PI * M_PI * rates.growth * (end_ - options_.start);
    if (!(exponent > kMostGrowthExponent)) return;
    const V3d& p = rates.growthAt;
    throw InvalidInput(fmt::format(
        "the speed grows with the curvature k at {:.6g},{:.6g},{:.6g} and time {:.6g}, by {:.3g} "
        "per unit of k, so that the slightest roughness of the surface grows without limit; use a "
        "speed that falls with k or does not depend on it",
        p.x, p.y, p.z, time, rates.growth * voxel_ * voxel_));
  }

  void step(double from, double to) {
    grid_ = motion_.step(*grid_, from, to);
    ++result_.steps;
    ratesAreCurrent_ = false;
    travelled_ += (to - from) * std::exchange(travel_, 0);
    diffused_ += (to - from) * std::exchange(diffusion_, 0);
    if (!eikonal::hasZeroCrossing(grid_->tree()))
      throw InvalidInput(fmt::format(
          "the solid vanishes after a time of {:.4g}, before the requested {:.4g}; give "
          "a shorter time or a smaller speed",
          to - options_.start, end_ - options_.start));
    if (travelled_ < kMostTravel && diffused_ < kMostDiffusion) return;
    grid_ = distanceTo(*grid_, width_);
    travelled_ = diffused_ = 0;
  }

  const EvolveOptions& options_;
  FrontMotion motion_;
  double voxel_, end_, width_;
  FloatGrid::Ptr grid_;
  bool ratesAreCurrent_ = false;
  double longest_ = 0;
  double travel_ = 0, diffusion_ = 0;  ///< largest rates since the last step
  double travelled_ = 0, diffused_ = 0;
  EvolveResult result_;
};

}  // namespace

EvolveResult evolve(NarrowBand solid, const NormalSpeed& speed, double time,
                    const EvolveOptions& options) {
  if (!speed) throw UsageError("the surface has no speed; give one");
  checkEvolveOptions(solid, time, options);
  if (time == 0) return {.band = std::move(solid)};
  Evolution evolution(solid, speed, time, options);
  return evolution.run(std::move(solid));
}

}  // namespace levelset
