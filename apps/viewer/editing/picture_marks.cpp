#include "apps/viewer/editing/picture_marks.h"

namespace viewer {

using Imath::V2d;
using Imath::V3d;

std::optional<V2d> seenAt(const V3d& point, const render::Camera& camera) {
  if (!camera.orthoHeight && !((point * camera.worldToCamera()).z > 0)) return std::nullopt;
  const V3d at = point * camera.worldToNdc();
  return V2d(at.x * camera.width, at.y * camera.height);
}

}  // namespace viewer
