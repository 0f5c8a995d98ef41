#pragma once

#include <Imath/ImathVec.h>

#include <optional>

#include "render/camera.h"

/// Points and lines that an editor draws over the picture. Positions are in pixels.
namespace viewer {

/// Distance from a point within which a press takes hold of it, pixels.
inline constexpr double kPointReach = 9;

/// A line in the picture.
struct PictureStroke {
  Imath::V2d from, to;
  bool isBehind = false;  ///< drawn faintly
};

/// A point in the picture that the user can drag.
struct PictureMark {
  Imath::V2d place;
  bool isCorner = true;  ///< drawn a little larger than other points
  bool isSelected = false;
  bool isBehind = false;  ///< drawn faintly
};

/// Position of a point in the picture; empty behind the eye.
[[nodiscard]] std::optional<Imath::V2d> seenAt(const Imath::V3d& point,
                                               const render::Camera& camera);

}  // namespace viewer
