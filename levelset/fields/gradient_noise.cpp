#include "levelset/fields/gradient_noise.h"

#include <cmath>
#include <cstdint>

namespace levelset {
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

double fadeCurve(double t) {
  return t * t * t * (t * (6 * t - 15) + 10);
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
    const double weight = (i ? fadeCurve(d.x) : 1 - fadeCurve(d.x)) *
                          (j ? fadeCurve(d.y) : 1 - fadeCurve(d.y)) *
                          (k ? fadeCurve(d.z) : 1 - fadeCurve(d.z));
    sum += weight * gradientPart(latticeHash(x + i, y + j, z + k), d - V3d(i, j, k));
  }
  return sum;
}

}  // namespace levelset
