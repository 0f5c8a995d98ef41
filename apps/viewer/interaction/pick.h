#pragma once

#include <Imath/ImathVec.h>

#include <optional>
#include <string>

#include "apps/viewer/interaction/progressive_picture.h"

namespace viewer {

/// A place on what is shown.
struct Picked {
  Imath::V3d position, normal;  ///< world units; of unit length, outwards
  double phi = 0;               ///< of what the scene draws of solids, world units
  std::string solid = {};       ///< its name
};

/// What is seen through the middle of a pixel; none where nothing is. @pre its pixels are single
[[nodiscard]] std::optional<Picked> pick(const Frame& frame, int x, int y);

/// Along the view axis, of what is seen there in a frame of any fineness; none where nothing is.
[[nodiscard]] std::optional<double> depthSeen(const Frame& frame, double x, double y);

/// "x,y,z" as the command line takes points.
[[nodiscard]] std::string pointText(const Imath::V3d& point);

/// One object: {"position": […], "normal": […], "phi": …, "solid": "…"}; null for none.
[[nodiscard]] std::string pickedJson(const std::optional<Picked>& picked);

}  // namespace viewer
