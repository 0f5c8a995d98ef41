#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <optional>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// Footprint of a patch on a surface, and how a moving surface carries it [Brodersen07 §10.2].
namespace mapping {

/// Data from which a patch can be rebuilt at another position.
struct PatchOutline {
  std::array<Imath::V3d, 4> corners;
  Imath::V3d middle;  ///< middle of the patch on the surface, approximate
  /// Direction of u at `middle`, for a patch that was placed around this point as a decal; empty:
  /// it is derived from the corners.
  std::optional<Imath::V3d> direction = {};
  double height = 0;  ///< height of the patch, world units, positive
};

/// Outline of a patch: its corners, its height, and the middle of its particles on the surface.
[[nodiscard]] PatchOutline outlineOf(const Patch& patch);

/// Footprint of a patch on one base: its corners, absolute and relative to its centre.
struct Footprint {
  std::array<Imath::V3d, 4> corners;  ///< corners, on the zero set
  /// Centre of the patch on the zero set; unit direction of u there; unit normal there.
  Imath::V3d centre, direction, normal;
  /// Geodesic coordinates of the corners relative to the centre, world units along u and v, see
  /// withReach(); empty: unknown.
  std::optional<std::array<Imath::V2d, 4>> reach = {};
  double height = 0;  ///< height of the patch, world units
  [[nodiscard]] bool operator==(const Footprint&) const = default;
};

/// Moves the corners and the middle of an outline to the closest points of the zero set.
/// @throws InvalidInput if there is no surface, or if a point is further from it than the diagonal
///         of the bounding box of the zero set
[[nodiscard]] Footprint footprintOf(const levelset::NarrowBand& base, const PatchOutline& outline);

/// Adds the geodesic coordinates of the corners relative to the centre: world units along u and
/// along v, which is anticlockwise from u seen from outside. `reach` stays empty if no geodesic
/// from the centre ends at a corner.
/// @param keepsDirection  false: `footprint.direction` becomes the mean direction from corners 0
///         and 3 to corners 1 and 2
[[nodiscard]] Footprint withReach(const levelset::NarrowBand& base, Footprint footprint,
                                  bool keepsDirection = false);

enum class CarryRule {
  Corners,  ///< each corner goes to the nearest point of the next base [Brodersen07 §10.2]
  /// Moves the centre to the nearest point of the next base and rotates u by the least rotation
  /// between the normals at both points. The corners keep their geodesic coordinates, so that the
  /// patch keeps its shape.
  Rigid
};

/// Carries a footprint to a base that moved a little. Only the shape of the base is known, so
/// motion of the surface along itself, as of a rotating ball, has no effect.
/// @param footprint  footprint on the previous base; CarryRule::Rigid needs its `reach`
/// @throws InvalidInput if there is no surface, or if it breaks off between the centre and a corner
[[nodiscard]] Footprint carryFootprint(const levelset::NarrowBand& base, const Footprint& footprint,
                                       CarryRule rule);

/// Largest displacement of a corner from one footprint to another, world units.
[[nodiscard]] double farthestMove(const Footprint& from, const Footprint& to);

/// Least and largest ratio of the straight length of a side or diagonal to its length in an earlier
/// footprint.
struct Drift {
  double least = 1, most = 1;
  /// Largest factor of growth or shrinkage, at least 1.
  [[nodiscard]] double factor() const;
};
/// Computes the ratios of the lengths of sides and diagonals in `now` to those in `first`.
[[nodiscard]] Drift driftBetween(const Footprint& first, const Footprint& now);

/// Moves a point rigidly with a patch, from the footprint `from` to `to`: u, v and the normal are
/// rotated into those of `to`; lengths are kept.
[[nodiscard]] Imath::V3d movedAlong(const Footprint& from, const Footprint& to,
                                    const Imath::V3d& point);

}  // namespace mapping
