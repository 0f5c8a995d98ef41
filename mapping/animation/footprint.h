#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <optional>

#include "levelset/narrow_band.h"
#include "mapping/patches/patch.h"

/// Where a patch stands, and how a moving surface carries it [Brodersen07 §10.2].
namespace mapping {

/// A patch as far as it has to be known to make it again elsewhere.
struct PatchOutline {
  std::array<Imath::V3d, 4> corners;
  Imath::V3d middle;  ///< about where its sides are halved
  /// Of u at the middle, which is a centre then, as of a decal; empty: the corners tell.
  std::optional<Imath::V3d> direction = {};
  double height = 0;  ///< world units, positive
};

/// Corners, and the middle of the particles on the surface.
[[nodiscard]] PatchOutline outlineOf(const Patch& patch);

/// A patch on one base: its corners, and the same as seen from its centre.
struct Footprint {
  std::array<Imath::V3d, 4> corners;                    ///< on the zero set
  Imath::V3d centre, direction, normal;                 ///< on the zero set; of u, unit; unit
  std::optional<std::array<Imath::V2d, 4>> reach = {};  ///< see withReach
  double height = 0;
  [[nodiscard]] bool operator==(const Footprint&) const = default;
};

/// Corners and middle projected along φ.
/// @throws InvalidInput where there is no surface, or it is further away than its diagonal
[[nodiscard]] Footprint footprintOf(const levelset::NarrowBand& base, const PatchOutline& outline);

/// With the straight ways from the centre to the corners along the surface: world units along u and
/// along v, which is anticlockwise from u seen from outside. Unless the outline has told it, the
/// direction becomes that in which the corners 1 and 2 lie from 0 and 3.
/// Without a reach where a corner is not to be reached straight from the centre.
[[nodiscard]] Footprint withReach(const levelset::NarrowBand& base, Footprint footprint,
                                  bool keepsDirection = false);

enum class CarryRule {
  Corners,  ///< each corner goes to the nearest point of the new surface [Brodersen07 §10.2]
  Rigid     ///< the centre does, u is turned by the least rotation, and the corners keep their ways
            ///< from there: the patch keeps its shape
};

/// A footprint on a base that was moved a little. What moves along itself, as a ball that turns,
/// takes nothing along: only its shape is known.
/// @param footprint  with a reach under CarryRule::Rigid
/// @throws InvalidInput where there is no surface, or it breaks off before a corner
[[nodiscard]] Footprint carryFootprint(const levelset::NarrowBand& base, const Footprint& footprint,
                                       CarryRule rule);

/// The farthest that a corner has gone.
[[nodiscard]] double farthestWay(const Footprint& from, const Footprint& to);

/// Straight lengths of the sides and diagonals over those of another footprint.
struct Drift {
  double least = 1, most = 1;
  /// The factor by which the worst has grown or shrunk, 1 or more.
  [[nodiscard]] double factor() const;
};
[[nodiscard]] Drift driftBetween(const Footprint& first, const Footprint& now);

/// A point that stood beside one footprint, beside another: u, v and the normal are turned over
/// into each other, lengths are kept.
[[nodiscard]] Imath::V3d movedAlong(const Footprint& from, const Footprint& to,
                                    const Imath::V3d& point);

}  // namespace mapping
