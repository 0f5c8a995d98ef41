#pragma once

#include <Imath/ImathMatrix.h>

#include "render/bricks/brick_pool.h"
#include "render/camera.h"

namespace render {

/// The rays of a picture in the space of a BrickPool's table, so that single precision is enough
/// for them however far away the camera is: t counts from a plane across the view just before the
/// surface, not before the camera's `near`, and a step of 1 is a step of 1 in depth.
///
/// The ray of the pixel whose centre is (x, y) right of and below the picture's centre, in pixels:
/// origin + x originX + y originY, direction + x directionX + y directionY.
struct RayFan {
  float origin[3], originX[3], originY[3];
  float direction[3], directionX[3], directionY[3];
  float low[3], high[3];  ///< box of the crossing cells

  double depth = 0;         ///< of the plane, world units along the view axis
  double depthPerStep = 0;  ///< what t = 1 is, world units
  [[nodiscard]] double depthAt(float t) const {
    return depth + static_cast<double>(t) * depthPerStep;
  }
};

/// @param voxelSize  world units
/// @pre the camera is valid and the pool has bricks
[[nodiscard]] RayFan makeRayFan(const Camera& camera, const Imath::M44d& tableToWorld,
                                double voxelSize, const BrickPool& pool);

}  // namespace render
