#include "render/bezier/bezier_part.h"

namespace render {

Hit BezierPart::hitOf(const Camera::Ray& ray, double distance, const Imath::V3d& normal,
                      std::size_t solid) const {
  Hit hit = exactHit(ray.origin + ray.direction * distance, distance, normal,
                     caster.bounds().size().length(), colour, id, solid);
  hit.opacity = opacity;
  return hit;
}

}  // namespace render
