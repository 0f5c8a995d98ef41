#include "render/quadrics/quadric_part.h"

#include <utility>

namespace render {

Hit QuadricPart::hitOf(const Camera::Ray& ray, double distance, const Imath::V3d& normal,
                       const Imath::C3f& colour, std::size_t solid) const {
  return exactHit(ray.origin + ray.direction * distance, distance, normal,
                  caster.bounds().size().length(), colour, id, solid);
}

QuadricPart makeQuadricPart(std::vector<Ball> balls, std::vector<Stick> sticks,
                            const std::string& name, std::size_t maxBytes) {
  const QuadricModel model{std::move(balls), std::move(sticks), {}};
  return {.caster = QuadricCaster(model, maxBytes), .name = name};
}

}  // namespace render
