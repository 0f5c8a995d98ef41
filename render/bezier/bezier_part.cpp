#include "render/bezier/bezier_part.h"

namespace render {

Hit BezierPart::hitOf(const Camera::Ray& ray, double distance, const Imath::V3d& normal,
                      std::size_t solid) const {
  constexpr double kHitError = 1e-10;  // of a root that is not singular, as a share of the diagonal
  Hit hit;
  hit.found = true;
  hit.distance = distance;
  hit.position = ray.origin + ray.direction * distance;
  hit.normal = hit.facetNormal = normal;
  hit.surfaceError = kHitError * caster.bounds().size().length();
  hit.colour = colour;
  hit.opacity = opacity;
  hit.id = id;
  hit.solid = solid;
  return hit;
}

}  // namespace render
