#pragma once

#include <Imath/ImathVec.h>

#include "render/effects/effects.h"
#include "render/images/image.h"

namespace render {

// Defaults of StereoOptions. @param depths  of the nearest and the farthest surface, world units
[[nodiscard]] inline double defaultEyeDistance(const Imath::V2d& depths) {
  return depths.x / 30;
}
[[nodiscard]] inline double defaultScreenDepth(const Imath::V2d& depths) {
  return 0.5 * (depths.x + depths.y);
}

/// Computes the picture of another eye from the depth layer. Surfaces that the picture does not
/// show are filled with the colours of the farther surface beside them.
/// @param shift  position of the eye, along the picture's x axis, world units
/// @param screenDepth  depth of the surfaces that do not move in the picture, world units
/// @return a picture with R, G, B and A
/// @throws levelset::InvalidInput for an orthographic picture, or without colours, depth or camera
[[nodiscard]] Image seenFromBeside(const Image& image, double shift, double screenDepth);

/// Combines pictures for the left and the right eye, as displayed.
/// @throws levelset::InvalidInput for pictures of different sizes, or without colours
[[nodiscard]] Image stereoPicture(const Image& left, const Image& right, Stereo kind);

/// Stereo picture from the depth layer of one picture.
/// @param eyeDistance, screenDepth  as EffectOptions; 0: their defaults
/// @param reduce  edge of the squares of pixels of each eye that become one pixel
[[nodiscard]] Image stereoOf(const Image& image, Stereo kind, double eyeDistance,
                             double screenDepth, int reduce = 1);

}  // namespace render
