#pragma once

#include <string>
#include <vector>

#include "levelset/fields/field.h"

/// Standard velocity fields for tests of advection.
namespace levelset {

/// LeVeque's deformation of the unit cube, used by Enright's test [LeVeque96, Enright02]: free of
/// divergence, stretches a sphere to a sheet and back within `period`.
/// @throws UsageError for a period that is not positive and finite; this holds for all three fields
[[nodiscard]] VectorField enrightVelocity(double period = 3);

/// Single vortex in the unit square, the same at every z; returns to its start after `period`
/// [Bell89, LeVeque96].
[[nodiscard]] VectorField vortexVelocity(double period = 8);

/// Rigid rotation, one turn anticlockwise about `axis` through `center` in `period`.
/// @throws UsageError also for an axis of zero length or a point that is not finite
[[nodiscard]] VectorField rotationVelocity(const Imath::V3d& center, const Imath::V3d& axis,
                                           double period = 1);

/// Velocity of an option: one known by its name, or a field.
struct NamedVelocity {
  std::string name = {};   ///< one of velocityNames(); empty: `field` counts
  VectorField field = {};  ///< world units per unit of time
};

/// Names of the velocities above: enright, rotation, vortex.
[[nodiscard]] const std::vector<std::string>& velocityNames();

}  // namespace levelset
