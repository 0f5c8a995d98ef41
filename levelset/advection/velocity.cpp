#include "levelset/advection/velocity.h"

#include <fmt/core.h>

#include <cmath>

#include "levelset/error.h"

namespace levelset {
namespace {

using Imath::V3d;

void requirePeriod(double period) {
  if (!(period > 0) || !std::isfinite(period))
    throw UsageError(fmt::format("the period is {}; give a positive, finite time", period));
}

/// Values sin²(πx) and sin(2πx).
struct Waves {
  double squared, twice;
  explicit Waves(double x) {
    const double s = std::sin(M_PI * x);
    squared = s * s;
    twice = 2 * s * std::cos(M_PI * x);
  }
};

}  // namespace

VectorField enrightVelocity(double period) {
  requirePeriod(period);
  return [period](const V3d& p, double time) {
    const Waves x(p.x), y(p.y), z(p.z);
    return std::cos(M_PI * time / period) * V3d(2 * x.squared * y.twice * z.twice,
                                                -x.twice * y.squared * z.twice,
                                                -x.twice * y.twice * z.squared);
  };
}

VectorField vortexVelocity(double period) {
  requirePeriod(period);
  return [period](const V3d& p, double time) {
    const Waves x(p.x), y(p.y);
    return std::cos(M_PI * time / period) * V3d(-x.squared * y.twice, y.squared * x.twice, 0);
  };
}

VectorField rotationVelocity(const V3d& center, const V3d& axis, double period) {
  requirePeriod(period);
  const V3d spin = axis.normalized() * (2 * M_PI / period);
  for (int i = 0; i < 3; ++i) {
    if (!std::isfinite(center[i]) || !std::isfinite(axis[i]) || !(spin.length2() > 0))
      throw UsageError(
          fmt::format("the rotation axis has direction {},{},{} and center {},{},{}; give a finite "
                      "direction other than zero and a finite center",
                      axis.x, axis.y, axis.z, center.x, center.y, center.z));
  }
  return [center, spin](const V3d& p, double) { return spin.cross(p - center); };
}

const std::vector<std::string>& velocityNames() {
  static const std::vector<std::string> names{"enright", "rotation", "vortex"};
  return names;
}

}  // namespace levelset
