#include "render/effects/solid_pattern.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "levelset/fields/gradient_noise.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::gradientNoise;

double turbulence(const V3d& p, int octaves) {
  double sum = 0, weight = 1, scale = 1;
  for (int i = 0; i < octaves; ++i, weight *= 0.5, scale *= 2)
    sum += weight * gradientNoise(p * scale);
  return sum;
}

V3d blend(const V3d& a, const V3d& b, double share) {
  return a + (b - a) * std::clamp(share, 0.0, 1.0);
}

V3d marble(const V3d& p) {
  const double wave =
      std::sin(2 * std::numbers::pi * (0.6 * p.x + 0.8 * p.y) + 5 * turbulence(p * 0.7, 5));
  const double vein = std::pow(0.5 + 0.5 * wave, 4.0);
  return blend(V3d(0.80, 0.79, 0.76), V3d(0.17, 0.19, 0.24), vein);
}

V3d wood(const V3d& p) {
  const V3d bent = p + V3d(gradientNoise(p * 0.45), gradientNoise(p * 0.45 + V3d(7.3)), 0) * 0.35;
  const double radius = std::hypot(bent.x - 2.1, bent.z + 1.3) * 2.2;
  const double ring = radius - std::floor(radius);
  const double late = ring < 0.8 ? std::pow(ring / 0.8, 2.5) : (1 - ring) / 0.2;
  const double fibre = 0.5 + 0.5 * gradientNoise(V3d(p.x * 14, p.y * 1.2, p.z * 14));
  const V3d colour = blend(V3d(0.62, 0.36, 0.17), V3d(0.27, 0.115, 0.045), late);
  return colour * (0.85 + 0.3 * fibre);
}

}  // namespace

V3d patternColour(SolidTexture texture, const V3d& p) {
  switch (texture) {
    case SolidTexture::Checker: {
      const double sum = std::floor(p.x) + std::floor(p.y) + std::floor(p.z);
      return std::fmod(std::abs(sum), 2.0) < 0.5 ? V3d(0.72, 0.69, 0.62) : V3d(0.10, 0.13, 0.18);
    }
    case SolidTexture::Noise:
      return blend(V3d(0.10, 0.22, 0.34), V3d(0.78, 0.70, 0.52), 0.5 + 0.9 * turbulence(p, 4));
    case SolidTexture::Marble:
      return marble(p);
    default:
      return wood(p);
  }
}

}  // namespace render
