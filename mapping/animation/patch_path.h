#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <vector>

#include "levelset/narrow_band.h"
#include "mapping/animation/footprint.h"

namespace mapping {

struct SurfaceFrame;

/// Path of a patch from one position to another on one base, for key frames [Brodersen07 §10.3].
///
/// The centre moves along a geodesic. u is transported along it. The angle that remains to the u of
/// the end position is distributed evenly over the path, so that patches may rotate. Under
/// CarryRule::Corners each corner has its own geodesic, as in [Brodersen07 §10.3]. The geodesic is
/// obtained by straightening a path beside the centre's path, so that around a pipe all corners go
/// around the same side. Under CarryRule::Rigid the geodesic coordinates of the corners are
/// interpolated linearly.
class PatchPath {
 public:
  /// Computes the path.
  /// @param guide  path of the centre on a similar base, which the new path follows so that it does
  ///         not jump to the other side; empty: the shortest path
  /// @throws InvalidInput if the surface does not connect the two positions, or, under
  ///         CarryRule::Rigid, a footprint has no `reach`
  PatchPath(const levelset::NarrowBand& base, Footprint from, Footprint to, CarryRule rule,
            const std::vector<Imath::V3d>& guide = {});

  /// Footprint at a point of the path.
  /// @param part  share of the path by arc length, 0 to 1; 0 and 1 give the original footprints
  /// @throws InvalidInput if the surface breaks off before a corner
  [[nodiscard]] Footprint at(double part) const;

  /// Releases the memory of the base. Another base with the same content must be set before at().
  void dropBase() { base_ = {}; }
  void setBase(const levelset::NarrowBand& base) { base_ = base; }

  [[nodiscard]] const std::vector<Imath::V3d>& centrePath() const { return path_; }
  /// True if the paths of the corners follow the centre's path. Otherwise each corner takes its own
  /// shortest path, which may lead around the other side of the object.
  [[nodiscard]] bool isAlike() const { return isAlike_; }
  /// Rotation of u on the path relative to parallel transport, radians, between −π and π.
  [[nodiscard]] double turn() const { return turn_; }
  /// True if the centre's path could not follow the guide of the constructor.
  [[nodiscard]] bool hasJumped() const { return hasJumped_; }

 private:
  [[nodiscard]] SurfaceFrame frameAt(double part) const;
  void findCentrePath(const std::vector<Imath::V3d>& guide);
  void carryDirections();
  void findCornerPaths();

  levelset::NarrowBand base_;
  Footprint from_, to_;
  CarryRule rule_;
  bool isConstant_ = false, isAlike_ = true, hasJumped_ = false;
  std::vector<Imath::V3d> path_, normals_, directions_;
  double turn_ = 0;
  std::array<std::vector<Imath::V3d>, 4> cornerPaths_;
};

}  // namespace mapping
