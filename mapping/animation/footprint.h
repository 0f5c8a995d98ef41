#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <optional>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// Footprint of a patch on a surface, and how a moving surface carries it [Brodersen07 §10.2].
namespace mapping {

/// Data from which a patch can be rebuilt elsewhere.
struct PatchOutline {
  std::array<Imath::V3d, 4> corners;
  Imath::V3d middle;  ///< about where the middles of opposite sides connect
  /// Direction of u at `middle`, which is then the centre, as for a decal; empty: derived from the
  /// corners.
  std::optional<Imath::V3d> direction = {};
  double height = 0;  ///< world units, positive
};

/// Outline of a patch: its corners, and the middle of its particles on the surface.
[[nodiscard]] PatchOutline outlineOf(const Patch& patch);

/// Footprint of a patch on one base: its corners, absolute and relative to its centre.
struct Footprint {
  std::array<Imath::V3d, 4> corners;  ///< on the zero set
  /// Point on the zero set; unit direction of u; unit normal.
  Imath::V3d centre, direction, normal;
  std::optional<std::array<Imath::V2d, 4>> reach = {};  ///< see withReach
  double height = 0;
  [[nodiscard]] bool operator==(const Footprint&) const = default;
};

/// Projects the corners and the middle of an outline along φ.
/// @throws InvalidInput if there is no surface, or it is further away than its diagonal
[[nodiscard]] Footprint footprintOf(const levelset::NarrowBand& base, const PatchOutline& outline);

/// Adds the geodesic coordinates of the corners relative to the centre: world units along u and
/// along v, which is anticlockwise from u seen from outside. If the outline has no direction, the
/// direction becomes the mean one from corners 0 and 3 to corners 1 and 2. `reach` stays empty if
/// no geodesic from the centre ends at a corner.
[[nodiscard]] Footprint withReach(const levelset::NarrowBand& base, Footprint footprint,
                                  bool keepsDirection = false);

enum class CarryRule {
  Corners,  ///< each corner goes to the nearest point of the new surface [Brodersen07 §10.2]
  /// Moves the centre, rotates u by the least rotation, and keeps the geodesic coordinates of the
  /// corners, so that the patch keeps its shape.
  Rigid
};

/// Carries a footprint to a base that moved a little. Only the shape of the base is known, so
/// motion of the surface along itself, as of a rotating ball, has no effect.
/// @param footprint  with a reach under CarryRule::Rigid
/// @throws InvalidInput if there is no surface, or it breaks off before a corner
[[nodiscard]] Footprint carryFootprint(const levelset::NarrowBand& base, const Footprint& footprint,
                                       CarryRule rule);

/// Largest displacement of a corner.
[[nodiscard]] double farthestMove(const Footprint& from, const Footprint& to);

/// Ratios of the straight lengths of the sides and diagonals to those of another footprint.
struct Drift {
  double least = 1, most = 1;
  /// Largest factor of growth or shrinkage, at least 1.
  [[nodiscard]] double factor() const;
};
[[nodiscard]] Drift driftBetween(const Footprint& first, const Footprint& now);

/// Moves a point rigidly with a footprint: u, v and the normal are rotated into those of the other
/// footprint; lengths are kept.
[[nodiscard]] Imath::V3d movedAlong(const Footprint& from, const Footprint& to,
                                    const Imath::V3d& point);

}  // namespace mapping
