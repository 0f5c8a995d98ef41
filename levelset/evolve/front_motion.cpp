#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "levelset/curvature_flow/curvature_rate_vdb.h"
#include "levelset/error.h"
#include "levelset/evolve/front_motion_vdb.h"
#include "levelset/hamilton_jacobi/hamiltonian.h"

namespace levelset::flow {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Index;

// Largest curvature that a speed receives, voxels⁻¹: that of a ball with a radius of one voxel.
constexpr double kMostCurvature = 2;
// Step of the differences of the speed in the curvature, voxels⁻¹.
constexpr double kCurvatureStep = 1e-3;
// Least slope |∇φ| by which κ|∇φ| is divided.
constexpr double kLeastSlope = 0.1;
// The motion of grid points up to this distance counts as motion of the surface, voxels.
constexpr double kBesideSurface = 1;

}  // namespace

/// The motion of the grid points of one leaf block at one time.
class FrontMotion::Leaf {
  struct Central {
    PaddedBlock block;  ///< φ, voxels
    Values rate;        ///< κ|∇φ|, voxels⁻¹
  };

 public:
  Leaf(const FrontMotion& motion, double time, const StencilBlock& block, const BandLeaf& leaf,
       const BandAccessor& accessor)
      : motion_(motion), time_(time), block_(block), leaf_(leaf) {
    if (!motion.options_.speed.usesCurvature) return;
    central_ = std::make_unique<Central>();
    const Coord origin = leaf.origin();
    central_->block.fill([&](const Coord& step) {
      return blockValues(accessor, origin.offsetBy(8 * step.x(), 8 * step.y(), 8 * step.z()));
    });
    const auto unit = static_cast<float>(1 / motion.voxel_);
    for (float& value : central_->block.values) value *= unit;
    curvatureRate(central_->block, leaf.getValueMask(), 0, central_->rate);
  }

  /// Returns F|∇φ|, voxels per unit of time.
  [[nodiscard]] double operator()(Index offset) const {
    const Point point = pointAt(offset);
    if (point.weight == 0) return 0;
    double value = 0;
    if (motion_.options_.speed.usesNormal) {
      value = hamiltonianAt(point).value;
    } else {
      const double speed = speedAt(point, V3d(0), 0);
      if (speed != 0) value = speed * godunovSlope(slopesAt(point), speed);
    }
    if (!isInCore(point)) return value;
    return value - coefficientAt(point) * point.rate;
  }

  /// Adds the speeds at a grid point to `rates`.
  void addRates(Index offset, MotionRates& rates) const {
    const Point point = pointAt(offset);
    if (point.weight == 0) return;
    double travel = 0;
    if (motion_.options_.speed.usesNormal) {
      const V3d speeds = hamiltonianAt(point).speeds;
      travel = speeds.x + speeds.y + speeds.z;
    } else {
      travel = std::sqrt(3.0) * std::abs(speedAt(point, V3d(0), 0));
    }
    double resistance = travel / motion_.options_.cfl;
    if (isInCore(point)) {
      const V3d gradient = gradientAt(point);
      const double coefficient = coefficientAt(point),
                   derivative = derivativeAt(point, gradient, curvatureAt(point, gradient)),
                   diffusion = std::max(std::abs(coefficient), std::abs(derivative));
      rates.diffusion = std::max(rates.diffusion, diffusion);
      resistance += diffusion / kExplicitStep;
      if (derivative > rates.growth) {
        rates.growth = derivative;
        rates.growthAt = point.world;
      }
      if (std::abs(point.phi) < kBesideSurface) travel += std::abs(coefficient * point.rate);
    }
    rates.travel = std::max(rates.travel, travel);
    rates.step = std::min(rates.step, 1 / resistance);
  }

 private:
  struct Point {
    Coord local;
    V3d world;
    double weight;
    double phi;       ///< voxels
    double rate = 0;  ///< κ|∇φ|, voxels⁻¹; only with a speed that depends on the curvature
  };

  [[nodiscard]] Point pointAt(Index offset) const {
    Point point{.local = BandLeaf::offsetToLocalCoord(offset), .world = {}, .weight = 1, .phi = 0};
    motion_.toWorld_.multVecMatrix(positionOf(leaf_, offset), point.world);
    if (motion_.options_.weight) point.weight = motion_.options_.weight(point.world);
    const Coord& c = point.local;
    point.phi = static_cast<double>(*block_.at(c[0], c[1], c[2])) / motion_.voxel_;
    if (central_) point.rate = static_cast<double>(central_->rate[offset]);
    return point;
  }

  [[nodiscard]] bool isInCore(const Point& point) const {
    return central_ && std::abs(point.phi) < kCurvatureCore;
  }

  /// Returns the speed, voxels per unit of time.
  /// @param gradient  of φ, index space; zero: the normal is not defined
  [[nodiscard]] double speedAt(const Point& point, const V3d& gradient, double curvature) const {
    SurfacePoint at{
        .position = point.world, .time = time_, .curvature = curvature / motion_.voxel_};
    if (motion_.options_.speed.usesNormal) {
      motion_.toWorld_.multDirMatrix(gradient, at.normal);
      at.normal.normalize();
    }
    const double speed = motion_.options_.speed.value(at) * point.weight;
    if (std::isfinite(speed)) return speed / motion_.voxel_;
    throw InvalidInput(fmt::format(
        "the speed is not finite at {:.6g},{:.6g},{:.6g} and time {:.6g}, for the normal "
        "{:.3g},{:.3g},{:.3g} and the curvature {:.3g}; give a speed that is finite near the "
        "surface, and at curvature 0 too",
        point.world.x, point.world.y, point.world.z, time_, at.normal.x, at.normal.y, at.normal.z,
        at.curvature));
  }

  [[nodiscard]] OneSidedSlopes slopesAt(const Point& point) const {
    const float* at = block_.at(point.local[0], point.local[1], point.local[2]);
    const int order = motion_.options_.orders.space;
    OneSidedSlopes slopes;
    for (int axis = 0; axis < 3; ++axis) {
      slopes.lower[axis] = oneSidedSlope(at, axis, -1, motion_.voxel_, order);
      slopes.upper[axis] = oneSidedSlope(at, axis, 1, motion_.voxel_, order);
    }
    return slopes;
  }

  [[nodiscard]] NumericalHamiltonian hamiltonianAt(const Point& point) const {
    return upwindHamiltonian(slopesAt(point), [&](const V3d& gradient) {
      const double slope = gradient.length();
      return slope > 0 ? speedAt(point, gradient, 0) * slope : 0;
    });
  }

  /// Returns the gradient of φ by central differences.
  [[nodiscard]] V3d gradientAt(const Point& point) const {
    const float* p = central_->block.at(point.local[0], point.local[1], point.local[2]);
    const auto difference = [&](int step) { return static_cast<double>(p[step] - p[-step]) / 2; };
    return {difference(PaddedBlock::kStepX), difference(PaddedBlock::kStepY), difference(1)};
  }

  /// Returns the curvature k that the speed receives, voxels⁻¹.
  [[nodiscard]] static double curvatureAt(const Point& point, const V3d& gradient) {
    return std::clamp(point.rate / std::max(gradient.length(), kLeastSlope), -kMostCurvature,
                      kMostCurvature);
  }

  /// Returns ∂F/∂k, voxels² per unit of time.
  [[nodiscard]] double derivativeAt(const Point& point, const V3d& gradient, double k) const {
    return (speedAt(point, gradient, k + kCurvatureStep) -
            speedAt(point, gradient, k - kCurvatureStep)) /
           (2 * kCurvatureStep);
  }

  /// Returns (F(0) − F(k)) / k, voxels² per unit of time. Times κ|∇φ| it is the part of −F|∇φ| that
  /// depends on the curvature, whatever the slope |∇φ|.
  [[nodiscard]] double coefficientAt(const Point& point) const {
    const V3d gradient = gradientAt(point);
    const double k = curvatureAt(point, gradient);
    if (std::abs(k) < kCurvatureStep) return -derivativeAt(point, gradient, 0);
    return (speedAt(point, gradient, 0) - speedAt(point, gradient, k)) / k;
  }

  const FrontMotion& motion_;
  double time_;
  const StencilBlock& block_;
  const BandLeaf& leaf_;
  std::unique_ptr<Central> central_;
};

FrontMotion::FrontMotion(FrontMotionOptions options, const Imath::M44d& toWorld, double voxelSize)
    : options_(std::move(options)), toWorld_(toWorld), voxel_(voxelSize) {}

MotionRates FrontMotion::rates(const FloatGrid& grid, double time) const {
  const std::vector<const BandLeaf*> leaves = leavesOf(grid.tree());
  std::vector<MotionRates> parts(leaves.size());
  tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
    const BandAccessor accessor(grid.tree());
    const StencilBlock block = stencilBlock(accessor, leaves[i]->origin());
    const Leaf leaf(*this, time, block, *leaves[i], accessor);
    for (auto it = leaves[i]->cbeginValueOn(); it; ++it) leaf.addRates(it.pos(), parts[i]);
  });
  MotionRates all;
  for (const MotionRates& part : parts) {
    all.step = std::min(all.step, part.step);
    all.travel = std::max(all.travel, part.travel);
    all.diffusion = std::max(all.diffusion, part.diffusion);
    if (part.growth <= all.growth) continue;
    all.growth = part.growth;
    all.growthAt = part.growthAt;
  }
  return all;
}

FloatGrid::Ptr FrontMotion::step(const FloatGrid& start, double from, double to) const {
  return rungeKuttaStep(start, options_.orders.time, from, to, [&](double time) {
    return [this, time](const StencilBlock& block, const BandLeaf& leaf,
                        const BandAccessor& accessor) {
      return Leaf(*this, time, block, leaf, accessor);
    };
  });
}

}  // namespace levelset::flow
