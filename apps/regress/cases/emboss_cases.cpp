#include <algorithm>
#include <cmath>

#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "apps/regress/truth/golden_section.h"
#include "levelset/emboss/emboss.h"

namespace regress {
namespace {

using Imath::V3d;
using levelset::NarrowBand;

constexpr double kReliefWidth = 0.7;

double cube(double x) {
  return x * x * x;
}

/// Ball of radius 1, embossed by a bell at a point of its surface: a surface of revolution. The
/// point of the ball at the angle t from the axis moves to the radius 1 + H (1 − u²)³.
Truth embossedBall(const V3d& centre, const V3d& axis, double height) {
  const double most = 2 * std::asin(kReliefWidth / 2);  // angle at which the height is zero
  const auto radiusAt = [=](double t) {
    const double u = 2 * std::sin(std::min(t, most) / 2) / kReliefWidth;
    return 1 + height * cube(std::max(1 - u * u, 0.0));
  };
  const auto distance = [=](const V3d& p) {
    const double along = (p - centre).dot(axis), out = (p - centre - along * axis).length();
    const auto squared = [&](double t) {
      const double r = radiusAt(t);
      const double x = r * std::cos(t) - along, y = r * std::sin(t) - out;
      return x * x + y * y;
    };
    constexpr int kIntervals = 24;
    double least = std::sqrt(squared(minimumBySections(squared, 0, most, kIntervals)));
    const double angle = std::atan2(out, along), length = std::hypot(out, along);
    if (angle >= most) least = std::min(least, std::abs(length - 1));
    return length < radiusAt(angle) ? -least : least;
  };
  return {.distance = distance, .centre = centre, .reach = 1.5};
}

void embossBall(Recorder& out) {
  const V3d axis = V3d(1, 2, 3).normalized();
  for (const Sample& at : out.samples()) {
    const NarrowBand solid = exactBand(ball(at.shift, 1), at.voxelSize);
    for (const double height : {0.3, -0.3})
      out.measure({height > 0 ? "rise" : "sink", at, embossedBall(at.shift, axis, height)}, kOurs,
                  [&] {
                    return levelset::emboss(solid, {.points = {at.shift + axis}}, kReliefWidth,
                                            height, {.profile = levelset::EmbossProfile::Smooth});
                  });
  }
}

Bounds embossBallBounds() {
  return Bounds()
      .measured("rise", "band_in_linf_vx", {{8, 0.00921}, {16, 0.00239}, {32, 0.000766}})
      .measured("rise", "band_out_linf_vx", {{8, 0.0099}, {16, 0.0024}, {32, 0.000729}})
      .measured("rise", "surface_l1_vx", {{8, 0.000572}, {16, 0.000121}, {32, 3.11e-05}})
      .measured("sink", "band_in_linf_vx", {{8, 0.0637}, {16, 0.00624}, {32, 0.00145}})
      .measured("sink", "band_out_linf_vx", {{8, 0.0292}, {16, 0.00461}, {32, 0.00115}})
      .measured("sink", "surface_l1_vx", {{8, 0.000829}, {16, 0.000147}, {32, 3.7e-05}});
}

}  // namespace

void addEmbossCases(std::vector<Case>& all) {
  all.push_back({.name = "emboss-ball",
                 .group = "emboss",
                 .title = "a bell that rises or sinks at a point of a ball",
                 .definition =
                     "A ball of radius 1 is embossed at a point of its surface with the profile "
                     "H (1 − u²)³, width 0.7 and H = ±0.3. A point of the ball at the distance d "
                     "from that point moves to the radius 1 + H (1 − (d/0.7)²)³. The exact "
                     "distance is the distance to this surface of revolution.",
                 .citation = "closed form",
                 .quick = {8, 16, 32},
                 .full = {16, 32, 64},
                 .bounds = embossBallBounds(),
                 .run = embossBall});
}

}  // namespace regress
