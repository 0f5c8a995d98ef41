#pragma once

#include "render/camera.h"
#include "render/images/image.h"
#include "render/shading/style.h"

namespace render {

/// Largest StyleOptions::lineWidth for Style::CurvatureLines, pixels.
inline constexpr double kWidestStreak = 16;

/// Draws Style::CurvatureLines into a lit picture: multiplies the colours by streaks of light and
/// dark along a principal direction. At each pixel, noise is averaged along the curve that follows
/// the projected direction through the pixel [Cabral93]. A direction has no sign. The walk along a
/// curve keeps its heading, so the streaks have no seams. A walk ends at outlines, creases and
/// umbilics. The contrast falls to 0 where the directions are undefined (directionWeight()).
///
/// A picture without the layers N, P, Z, id, curvature.k1, curvature.k2 and those of the direction
/// does not change.
/// @param range  curvature range, per world unit, as from curvatureRangeOf()
/// @pre options.lineWidth is at most kWidestStreak
void drawCurvatureLines(Image& image, const Camera& camera, const StyleOptions& options,
                        double range);

}  // namespace render
