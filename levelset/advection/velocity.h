#pragma once

#include <string>
#include <vector>

#include "levelset/fields/field.h"

/// Standard velocity fields for tests of advection.
namespace levelset {

/// Returns LeVeque's deformation of the unit cube, the velocity of Enright's test [LeVeque96,
/// Enright02]. It is divergence-free, and stretches a sphere to a sheet and back within `period`.
/// @throws UsageError for a period that is not positive and finite; vortexVelocity() and
///         rotationVelocity() throw it too
[[nodiscard]] VectorField enrightVelocity(double period = 3);

/// Returns a single vortex in the unit square, the same at every z. It reverses, so that each point
/// returns to its start after `period` [Bell89, LeVeque96].
[[nodiscard]] VectorField vortexVelocity(double period = 8);

/// Returns a rigid rotation: one turn anticlockwise about `axis` through `center` in `period`.
/// @throws UsageError for an axis that is zero or not finite, or a center that is not finite
[[nodiscard]] VectorField rotationVelocity(const Imath::V3d& center, const Imath::V3d& axis,
                                           double period = 1);

/// Velocity that an option gives: a built-in one by its name, or a field.
struct NamedVelocity {
  std::string name = {};   ///< one of velocityNames(), or empty: use `field`
  VectorField field = {};  ///< world units per unit of time; used if `name` is empty
};

/// Returns the names of the built-in velocities: enright, rotation, vortex.
[[nodiscard]] const std::vector<std::string>& velocityNames();

}  // namespace levelset
