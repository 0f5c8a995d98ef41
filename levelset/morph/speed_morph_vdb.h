#pragma once

// For the .cpp files of levelset/morph only.

#include <cstddef>

#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset {

/// Refuses solids that the speed V = φ − φ_target cannot connect: the front moves continuously, so
/// that each connected part of the target must overlap the solid, and each cavity of the target
/// must overlap the space outside the solid.
/// @param solid, target  distances on one grid
/// @throws InvalidInput
void requireOverlap(const openvdb::FloatGrid& solid, const openvdb::FloatGrid& target);

/// Level-set morph with the speed V = φ − φ_target: φ_t + c(φ) V |∇φ| = 0. Units of time are pure
/// numbers: along a common normal the distance to the target falls as exp(−t).
class SpeedMorph {
 public:
  /// @param solid   start of the morph
  /// @param target  distance to the target at least wherever the surface passes; must outlive this
  SpeedMorph(const openvdb::FloatGrid& solid, const openvdb::FloatGrid& target,
             std::size_t maxMemory);

  /// Moves the surface until a time, from where it is.
  /// @throws InvalidInput if the solid vanishes
  void advanceTo(double time, const Progress& progress);

  /// Moves the surface until it is steady: it is within 0.01 voxel of the target, or no grid point
  /// has changed sides for some time.
  /// @throws NumericalError if the surface is still more than a voxel from the target
  void converge(const Progress& progress);

  /// Distances to the surface at the present time.
  [[nodiscard]] openvdb::FloatGrid::Ptr surface(double halfWidth) const;

 private:
  void step(double longest);
  void redistance();
  /// Largest |c(φ) V| on the grid points with |φ| < `width` voxels, voxels per unit of time.
  [[nodiscard]] double largestSpeed(double width) const;

  const openvdb::FloatGrid& target_;
  std::size_t maxMemory_;
  openvdb::FloatGrid::Ptr phi_;   ///< distance to the surface in the working band
  openvdb::FloatGrid::Ptr goal_;  ///< distance to the target on the grid points of phi_
  double time_ = 0;
  double travelled_ = 0;   ///< voxels since phi_ was redistanced
  double lastChange_ = 0;  ///< time at which a grid point changed sides
};

}  // namespace levelset
