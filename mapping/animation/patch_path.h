#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/animation/footprint.h"

namespace mapping {

struct SurfaceFrame;

/// The way of a patch from one place to another on one base: key frames [Brodersen07 §10.3].
///
/// The centre moves along a geodesic, u is carried along it and turned evenly by what is left at
/// the end, so that patches may rotate. Under CarryRule::Corners each corner has a geodesic of its
/// own, as in the thesis; theirs are straightened from ways that lie beside the centre's, so around
/// a pipe all of them go the same way. Under CarryRule::Rigid the shape changes evenly in between.
class PatchPath {
 public:
  /// @param guide  the centre's way on a base that was much the same: theirs runs likewise, and
  ///               does not jump to the other side; empty: the shortest
  /// @throws InvalidInput when the surface does not join the two places, or a footprint has no
  ///         reach under CarryRule::Rigid
  PatchPath(const levelset::NarrowBand& base, Footprint from, Footprint to, CarryRule rule,
            const std::vector<Imath::V3d>& guide = {});

  /// @param part  of the way by arc length, 0 to 1; at both ends the footprints themselves
  /// @throws InvalidInput where the surface breaks off before a corner
  [[nodiscard]] Footprint at(double part) const;

  /// Lets go of the base's memory; another of the same content has to be set before at().
  void dropBase() { base_ = {}; }
  void setBase(const levelset::NarrowBand& base) { base_ = base; }

  [[nodiscard]] const std::vector<Imath::V3d>& centreWay() const { return way_; }
  /// Do the corners run beside the centre? Otherwise each takes its own shortest way, which may
  /// lead around the other side.
  [[nodiscard]] bool isAlike() const { return isAlike_; }
  /// Radians that u turns on the way, beyond what the surface does; between −π and π.
  [[nodiscard]] double turn() const { return turn_; }
  /// Was there a guide that could not be followed?
  [[nodiscard]] bool hasJumped() const { return hasJumped_; }

 private:
  [[nodiscard]] SurfaceFrame frameAt(double part) const;
  void findCentreWay(const std::vector<Imath::V3d>& guide);
  void carryDirections();
  void findCornerWays();

  levelset::NarrowBand base_;
  Footprint from_, to_;
  CarryRule rule_;
  bool isConstant_ = false, isAlike_ = true, hasJumped_ = false;
  std::vector<Imath::V3d> way_, normals_, directions_;
  double turn_ = 0;
  std::array<std::vector<Imath::V3d>, 4> cornerWays_;
};

}  // namespace mapping
