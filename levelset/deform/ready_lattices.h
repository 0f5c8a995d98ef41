#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <span>

#include "levelset/deform/control_lattice.h"

/// Bend, twist, taper and stretch [Barr84] as lattices.
namespace levelset {

/// Box with its own directions, world space.
struct OrientedBox {
  Imath::V3d centre{0};
  /// Unit vectors, right-handed. The third is the axis of a deformation.
  std::array<Imath::V3d, 3> directions = {Imath::V3d(1, 0, 0), Imath::V3d(0, 1, 0),
                                          Imath::V3d(0, 0, 1)};
  Imath::V3d halfSize{1};  ///< half the edges along the directions, positive
};

/// Returns right-handed directions for a deformation along an axis.
/// @param axis     third direction, any length
/// @param towards  the first direction is the part of it that is perpendicular to the axis; zero:
/// any
/// @throws UsageError for an axis without direction, and a `towards` that is parallel to it
[[nodiscard]] std::array<Imath::V3d, 3> directionsAlong(const Imath::V3d& axis,
                                                        const Imath::V3d& towards);

/// Returns the smallest box with given directions around points, enlarged on each side.
/// @param margin  width added on each side, world units. A side without extent gets 1e-3 of the
///                longest one.
/// @throws InvalidInput without points, or if all lie at one position
[[nodiscard]] OrientedBox boxAround(std::span<const Imath::V3d> points,
                                    const std::array<Imath::V3d, 3>& directions, double margin);

/// A lattice for a deformation in closed form.
struct ReadyLattice {
  ControlLattice lattice;
  /// Largest distance between a point of the lattice and of the closed form, at test points in the
  /// entire box, world units.
  double error = 0;
};

/// Bends a box about an axis along the second direction. Its middle stays in its place and its
/// length; lines along the third direction become arcs that together turn by `angle` towards the
/// first direction. The Jacobian is 1 − angle x / length, where x is the distance from the middle
/// towards the first direction. So the box folds if its length is at most angle × half its width.
///
/// Sine and cosine are no polynomials. They are interpolated by B-splines of degree 5 at the
/// Greville abscissae, with as many spans as the tolerance needs. Rational arcs would be exact
/// circles, but not of uniform speed.
/// @param angle      radians, magnitude at most 100
/// @param tolerance  largest distance from the closed form, world units, positive
/// @throws UsageError for an angle or a tolerance out of range
/// @throws InvalidInput when the tolerance is below what double precision or 512 spans reach
[[nodiscard]] ReadyLattice bendLattice(const OrientedBox& box, double angle, double tolerance);

/// Twists a box about its third direction through its centre by `angle` from one end to the other.
/// The middle stays in its place. The Jacobian is 1. Parameters and errors as bendLattice().
[[nodiscard]] ReadyLattice twistLattice(const OrientedBox& box, double angle, double tolerance);

/// Scales the cross-sections of a box, linearly from 1 at the begin of the third direction to
/// `factor` at its end. Exact, of degree 1. The Jacobian is the square of the scale.
/// @throws UsageError unless the factor is positive and finite
[[nodiscard]] ReadyLattice taperLattice(const OrientedBox& box, double factor);

/// Scales a box along its third direction. The centre stays in its place. Exact, of degree 1. The
/// Jacobian is `factor`.
/// @throws UsageError unless the factor is positive and finite
[[nodiscard]] ReadyLattice stretchLattice(const OrientedBox& box, double factor);

// The closed forms.
[[nodiscard]] Imath::V3d bent(const OrientedBox& box, double angle, const Imath::V3d& world);
[[nodiscard]] Imath::V3d twisted(const OrientedBox& box, double angle, const Imath::V3d& world);
[[nodiscard]] Imath::V3d tapered(const OrientedBox& box, double factor, const Imath::V3d& world);
[[nodiscard]] Imath::V3d stretched(const OrientedBox& box, double factor, const Imath::V3d& world);

}  // namespace levelset
