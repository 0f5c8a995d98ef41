#pragma once

#include <Imath/ImathVec.h>

#include <optional>
#include <string>

#include "apps/viewer/interaction/progressive_picture.h"
#include "apps/viewer/text/point_text.h"

namespace viewer {

/// A point of a visible surface or slice that the user picked.
struct Picked {
  Imath::V3d position, normal;  ///< position in world units; outward unit normal
  double phi = 0;          ///< φ of the drawn shape at `position`, world units; NaN for a volume
  std::string solid = {};  ///< name of the solid or mesh at the point
  std::optional<double> value = {};  ///< trilinear interpolant of a volume at `position`
};

/// Surface point at the centre of the pixel (x, y); nothing if the pixel shows no surface or slice.
/// @pre `pixelSize` of the frame is 1
[[nodiscard]] std::optional<Picked> pick(const Frame& frame, int x, int y);

/// Depth of the surface or slice at the picture position (x, y) in window pixels, along the view
/// axis, world units. Nothing if there is neither. The frame may have any pixel size.
[[nodiscard]] std::optional<double> depthSeen(const Frame& frame, double x, double y);

/// Formats a picked point as a JSON object {"position": […], "normal": […], "phi": …, "solid":
/// "…"}; for a volume φ is null, and "value" is its value. Returns "null" without a point.
[[nodiscard]] std::string pickedJson(const std::optional<Picked>& picked);

}  // namespace viewer
