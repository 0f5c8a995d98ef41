#include "levelset/advection/time_interval.h"

#include <fmt/core.h>

#include <cmath>

#include "levelset/error.h"

namespace levelset::flow {

using Imath::V3d;

void requireFinite(const TimeInterval& interval, const V3d& velocity, const V3d& position,
                   double time) {
  if (std::isfinite(velocity.x) && std::isfinite(velocity.y) && std::isfinite(velocity.z)) return;
  V3d world;
  interval.toWorld.multVecMatrix(position, world);
  throw InvalidInput(
      fmt::format("the velocity is not finite at {:.6g},{:.6g},{:.6g} and time {:.6g}; give a "
                  "velocity that is finite along the path of the surface",
                  world.x, world.y, world.z, time));
}

}  // namespace levelset::flow
