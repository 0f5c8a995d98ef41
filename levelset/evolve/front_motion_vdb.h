#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathMatrix.h>

#include <functional>

#include "levelset/fields/field.h"
#include "levelset/hamilton_jacobi/upwind_stage_vdb.h"
#include "levelset/vdb.h"

namespace levelset::flow {

/// Speed of a surface, and the schemes that discretise it.
struct FrontMotionOptions {
  NormalSpeed speed;
  std::function<double(const Imath::V3d& world)> weight = {};  ///< factor of the speed; empty: 1
  UpwindOrders orders = {};
  double cfl = 0.5;  ///< Courant number of the steps
};

/// Half width of the band in which a surface moves, voxels. With a speed that depends on the
/// curvature, grid points up to kCurvatureCore from the surface move with their curvature. Beyond
/// them central differences would read values outside the band.
inline constexpr double kMotionWidth = 6, kCurvatureWidth = 8.1, kCurvatureCore = 5.2;

/// Largest speeds of a band at one time, in voxels and units of time.
struct MotionRates {
  double step = HUGE_VAL;  ///< longest step
  double travel = 0;       ///< speed of the level sets, an upper bound
  double diffusion = 0;    ///< −∂F/∂k, voxels² per unit of time
  /// Largest ∂F/∂k, voxels² per unit of time, and its place, world units. Where F grows with the
  /// curvature, waves on the surface grow too, and short waves fastest.
  double growth = 0;
  Imath::V3d growthAt = Imath::V3d(0);
};

/// Motion of a band by φ_t + F|∇φ| = 0. F is split into F at curvature 0, which is discretised with
/// upwind differences, and the rest, which is discretised with the central differences of
/// curvatureRate().
class FrontMotion {
 public:
  /// @param toWorld  rotation, uniform scale, translation
  FrontMotion(FrontMotionOptions options, const Imath::M44d& toWorld, double voxelSize);

  /// Half width of the band that step() needs, voxels.
  [[nodiscard]] double width() const {
    return options_.speed.usesCurvature ? kCurvatureWidth : kMotionWidth;
  }
  [[nodiscard]] bool changesInTime() const { return options_.speed.usesTime; }

  /// Computes the largest speeds on the active grid points.
  /// @throws InvalidInput where the speed is not finite
  [[nodiscard]] MotionRates rates(const openvdb::FloatGrid& grid, double time) const;
  /// Computes a step between two times on the active grid points, without redistancing.
  [[nodiscard]] openvdb::FloatGrid::Ptr step(const openvdb::FloatGrid& start, double from,
                                             double to) const;

 private:
  class Leaf;

  FrontMotionOptions options_;
  Imath::M44d toWorld_;
  double voxel_;
};

}  // namespace levelset::flow
