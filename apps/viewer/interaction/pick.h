#pragma once

#include <Imath/ImathVec.h>

#include <optional>
#include <string>

#include "apps/viewer/interaction/progressive_picture.h"

namespace viewer {

/// A point on a visible surface.
struct Picked {
  Imath::V3d position, normal;  ///< world units; outward unit normal
  double phi = 0;               ///< φ of the drawn shape, world units
  std::string solid = {};       ///< name of the solid
};

/// Surface point at the centre of a pixel; none for a miss. @pre the frame has pixel size 1
[[nodiscard]] std::optional<Picked> pick(const Frame& frame, int x, int y);

/// Depth along the view axis of the surface at a picture position, in a frame of any pixel size;
/// none for a miss.
[[nodiscard]] std::optional<double> depthSeen(const Frame& frame, double x, double y);

/// Formats a point as "x,y,z", the form of the command line.
[[nodiscard]] std::string pointText(const Imath::V3d& point);

/// JSON object {"position": […], "normal": […], "phi": …, "solid": "…"}; null for none.
[[nodiscard]] std::string pickedJson(const std::optional<Picked>& picked);

}  // namespace viewer
