#pragma once

#include <string>
#include <vector>

#include "levelset/fields/field.h"

/// Velocities that everybody measures advection with.
namespace levelset {

/// LeVeque's deformation of the unit cube, which Enright's test uses [LeVeque96, Enright02]: no
/// divergence, stretches a sphere to a sheet and back within `period`.
/// @throws UsageError for a period that is not positive and finite; so do the others
[[nodiscard]] VectorField enrightVelocity(double period = 3);

/// The single vortex in the unit square, the same at every z; back at its start after `period`
/// [Bell89, LeVeque96].
[[nodiscard]] VectorField vortexVelocity(double period = 8);

/// Rigid rotation, one turn anticlockwise about `axis` through `center` in `period`.
/// @throws UsageError also for an axis without direction or a point that is not finite
[[nodiscard]] VectorField rotationVelocity(const Imath::V3d& center, const Imath::V3d& axis,
                                           double period = 1);

/// Velocity of an option: one known by its name, or a field.
struct NamedVelocity {
  std::string name;   ///< one of velocityNames(); empty: `field` counts
  VectorField field;  ///< world units per unit of time
};

/// Names of the velocities above: enright, rotation, vortex.
[[nodiscard]] const std::vector<std::string>& velocityNames();

}  // namespace levelset
