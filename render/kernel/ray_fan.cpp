#include "render/kernel/ray_fan.h"

#include <algorithm>
#include <limits>

namespace render {
namespace {

using Imath::M44d;
using Imath::V3d;

V3d directionIn(const M44d& worldToTable, const V3d& world) {
  V3d result;
  worldToTable.multDirMatrix(world, result);
  return result;
}

void set(float (&to)[3], const V3d& from) {
  for (int a = 0; a < 3; ++a) to[a] = static_cast<float>(from[a]);
}

}  // namespace

RayFan makeRayFan(const Camera& camera, const M44d& tableToWorld, double voxelSize,
                  const BrickPool& pool) {
  const M44d worldToTable = tableToWorld.inverse();
  const V3d axis = camera.axis();
  const Camera::PixelSteps step = camera.pixelSteps();

  // Depth along the view axis of the nearest corner of the box of the surface's blocks.
  double depth = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i) {
    const V3d p(i & 4 ? pool.high[0] : pool.low[0], i & 2 ? pool.high[1] : pool.low[1],
                i & 1 ? pool.high[2] : pool.low[2]);
    depth = std::min(depth, (p * tableToWorld - camera.from).dot(axis));
  }
  // Start two voxels in front of the box, because the surface may lie on its faces, but not before
  // the camera's `near`.
  depth = std::max(depth - 2 * voxelSize, camera.near);

  RayFan fan;
  fan.depth = depth;
  const V3d forward = directionIn(worldToTable, axis);
  fan.depthPerStep = 1 / forward.length();
  const V3d right = directionIn(worldToTable, step.right),
            down = directionIn(worldToTable, step.down);
  const bool isOrtho = camera.orthoHeight.has_value();
  const double spread = isOrtho ? 1 : depth, turn = isOrtho ? 0 : fan.depthPerStep;
  fan.exactOrigin = (camera.from + axis * depth) * worldToTable;
  fan.exactOriginX = right * spread;
  fan.exactOriginY = down * spread;
  fan.exactDirection = forward * fan.depthPerStep;
  fan.exactDirectionX = right * turn;
  fan.exactDirectionY = down * turn;
  set(fan.origin, fan.exactOrigin);
  set(fan.originX, fan.exactOriginX);
  set(fan.originY, fan.exactOriginY);
  set(fan.direction, fan.exactDirection);
  set(fan.directionX, fan.exactDirectionX);
  set(fan.directionY, fan.exactDirectionY);
  for (std::size_t a = 0; a < 3; ++a) {
    fan.low[a] = static_cast<float>(pool.low[a]);
    fan.high[a] = static_cast<float>(pool.high[a]);
  }
  return fan;
}

}  // namespace render
