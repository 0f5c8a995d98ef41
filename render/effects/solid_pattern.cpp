#include "render/effects/solid_pattern.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace render {
namespace {

using Imath::V3d;

std::uint32_t latticeHash(std::int64_t x, std::int64_t y, std::int64_t z) {
  auto h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^
           static_cast<std::uint32_t>(y) * 0xd8163841u ^
           static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
  h ^= h >> 16;
  h *= 0x7feb352du;
  h ^= h >> 15;
  h *= 0x846ca68bu;
  return h ^ h >> 16;
}

/// Dot product of an offset and one of the twelve gradients towards the edges of a cube.
double gradientPart(std::uint32_t hash, const V3d& d) {
  const std::uint32_t n = hash % 12, axis = n / 4;
  const double u = axis == 0 ? d.y : d.x, v = axis == 2 ? d.y : d.z;
  return (n & 1 ? -u : u) + (n & 2 ? -v : v);
}

double fade(double t) {
  return t * t * t * (t * (6 * t - 15) + 10);
}

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

double gradientNoise(const V3d& p) {
  const V3d low(std::floor(p.x), std::floor(p.y), std::floor(p.z)), d = p - low;
  if (!std::isfinite(low.x) || !std::isfinite(low.y) || !std::isfinite(low.z)) return 0;
  // The hash depends on the lowest 32 bits. Numbers above 2^63 have no std::int64_t.
  const auto cell = [](double c) { return static_cast<std::int64_t>(std::fmod(c, 0x1p32)); };
  const std::int64_t x = cell(low.x), y = cell(low.y), z = cell(low.z);
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    const double weight = (i ? fade(d.x) : 1 - fade(d.x)) * (j ? fade(d.y) : 1 - fade(d.y)) *
                          (k ? fade(d.z) : 1 - fade(d.z));
    sum += weight * gradientPart(latticeHash(x + i, y + j, z + k), d - V3d(i, j, k));
  }
  return sum;
}

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
