#pragma once

// Private to render: directions and shares of the light at a surface between two media.

#include <Imath/ImathVec.h>

#include <cmath>
#include <optional>

namespace render {

/// Direction of the mirrored ray. @param normal  unit normal
[[nodiscard]] inline Imath::V3d mirrored(const Imath::V3d& direction, const Imath::V3d& normal) {
  return direction - normal * (2 * direction.dot(normal));
}

/// Direction of the ray behind a surface, by Snell's law; empty under total reflection.
/// @param normal  unit normal, against the ray
/// @param ratio  index of refraction behind the surface over that in front of it
[[nodiscard]] inline std::optional<Imath::V3d> refracted(const Imath::V3d& direction,
                                                         const Imath::V3d& normal, double ratio) {
  if (ratio == 1) return direction;
  const double cosine = -direction.dot(normal);
  const double squared = 1 - (1 - cosine * cosine) / (ratio * ratio);
  if (squared < 0) return std::nullopt;
  return direction / ratio + normal * (cosine / ratio - std::sqrt(squared));
}

/// Share of unpolarised light that a surface between two clear media reflects, by Fresnel's
/// equations; 1 under total reflection. @param cosine  of the angle to the normal, from 0 to 1
/// @param ratio  as refracted()
[[nodiscard]] inline double fresnelShare(double cosine, double ratio) {
  if (ratio == 1) return 0;
  const double squared = ratio * ratio - (1 - cosine * cosine);
  if (squared <= 0) return 1;
  const double behind = std::sqrt(squared);  // ratio times the cosine behind the surface
  const double across = (cosine - behind) / (cosine + behind);
  const double square = ratio * ratio;
  const double along = (square * cosine - behind) / (square * cosine + behind);
  return 0.5 * (across * across + along * along);
}

/// Share that a mirror reflects, by Schlick's formula [Schlick94].
/// @param straight  share at a right angle
[[nodiscard]] inline double schlickShare(double straight, double cosine) {
  return straight + (1 - straight) * std::pow(1 - cosine, 5);
}

}  // namespace render
