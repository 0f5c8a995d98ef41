#include "apps/viewer/model/matcap_ball.h"

#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>

namespace viewer {
namespace {

using Imath::C3f;
using Imath::V3d;

/// Linear colour of the ball at a unit normal in camera space: x right, y up, z towards the eye.
C3f ballColour(const V3d& normal) {
  const V3d key = V3d(-0.5, 0.7, 0.6).normalized(), fill = V3d(0.4, -0.8, 0.3).normalized();
  const double warm = std::max(0.0, normal.dot(key)), cool = std::max(0.0, normal.dot(fill));
  const V3d halfway = (key + V3d(0, 0, 1)).normalized();
  const double shine = std::pow(std::max(0.0, normal.dot(halfway)), 60);
  const double rim = 0.35 + 0.65 * std::sqrt(std::max(0.0, normal.z));
  const auto part = [&](double base, double keyPart, double fillPart) {
    return static_cast<float>(
        std::min(1.0, rim * (base + keyPart * warm + fillPart * cool) + 0.5 * shine));
  };
  return {part(0.05, 0.55, 0.04), part(0.035, 0.26, 0.07), part(0.03, 0.14, 0.16)};
}

}  // namespace

std::shared_ptr<const render::ColourImage> matcapBall() {
  static const std::shared_ptr<const render::ColourImage> ball = [] {
    constexpr int kEdge = 256;
    auto image = std::make_shared<render::ColourImage>();
    image->width = image->height = kEdge;
    for (int row = 0; row < kEdge; ++row)
      for (int column = 0; column < kEdge; ++column) {
        V3d normal(2 * (column + 0.5) / kEdge - 1, 1 - 2 * (row + 0.5) / kEdge, 0);
        const double away2 = normal.length2();
        // Beside the ball the colour of its rim continues, so that interpolation stays smooth.
        if (away2 < 1)
          normal.z = std::sqrt(1 - away2);
        else
          normal.normalize();
        image->pixels.push_back(ballColour(normal));
      }
    return image;
  }();
  return ball;
}

}  // namespace viewer
