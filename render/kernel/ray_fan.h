#pragma once

#include <Imath/ImathMatrix.h>

#include <utility>

#include "render/bricks/brick_pool.h"
#include "render/camera.h"

namespace render {

/// Camera rays in the table space of a BrickPool, as linear functions of the pixel position. The
/// parameter t counts from a plane across the view just in front of the surface, in voxels of
/// depth. So single precision suffices for any distance of the camera.
///
/// For the pixel with centre (x, y), measured in pixels to the right of and below the picture's
/// centre, the ray is origin + x originX + y originY, direction + x directionX + y directionY.
struct RayFan {
  float origin[3], originX[3], originY[3];
  float direction[3], directionX[3], directionY[3];
  float low[3], high[3];  ///< box of the blocks that the surface crosses, table space

  // The same rays in double precision.
  Imath::V3d exactOrigin, exactOriginX, exactOriginY, exactDirection, exactDirectionX,
      exactDirectionY;

  double depth = 0;         ///< depth of the plane t = 0, world units along the view axis
  double depthPerStep = 0;  ///< increase of depth per unit of t, world units
  [[nodiscard]] double depthAt(double t) const { return depth + t * depthPerStep; }
  /// Origin and direction of the ray through a pixel, in double precision.
  [[nodiscard]] std::pair<Imath::V3d, Imath::V3d> exactRay(double x, double y) const {
    return {exactOrigin + exactOriginX * x + exactOriginY * y,
            exactDirection + exactDirectionX * x + exactDirectionY * y};
  }
};

/// Builds the rays of a camera for a pool.
/// @param voxelSize  voxel size of the band, world units
/// @pre the camera is valid and the pool has bricks
[[nodiscard]] RayFan makeRayFan(const Camera& camera, const Imath::M44d& tableToWorld,
                                double voxelSize, const BrickPool& pool);

}  // namespace render
