#include "levelset/emboss/emboss_section.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "levelset/emboss/emboss_curve.h"
#include "tests/support/measured.h"

namespace emboss_section_test {

using namespace levelset;
using embossing::EmbossCurve;
using embossing::EmbossSection;
using embossing::Polyline;
using Imath::V2d;
using openvdb::Vec3d;
using std::numbers::pi;

constexpr EmbossProfile kProfiles[] = {EmbossProfile::Round, EmbossProfile::Flat,
                                       EmbossProfile::Sharp, EmbossProfile::Smooth};

/// Height of a unit profile.
double unitHeight(EmbossProfile profile, double u) {
  if (u >= 1) return 0;
  if (profile == EmbossProfile::Round) return std::sqrt(1 - u * u);
  if (profile == EmbossProfile::Flat) return 1;
  if (profile == EmbossProfile::Sharp) return 1 - u;
  return std::pow(1 - u * u, 3);
}

double toSegment(const V2d& p, const V2d& a, const V2d& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).length2(), 0.0, 1.0);
  return (p - a - t * (b - a)).length();
}

/// Distance to a fine polyline on the section, and to the ray beyond it.
double fineDistance(EmbossProfile profile, double width, double height, const V2d& p) {
  constexpr int kSteps = 2000;
  double least = std::hypot(std::max(width - p.x, 0.0), p.y);
  V2d last(0, height);
  for (int i = 1; i <= kSteps; ++i) {
    const double u = std::sin(pi / 2 * i / kSteps);  // dense where the half ellipse is steep
    const V2d next(width * u, i < kSteps ? height * unitHeight(profile, u)
                                         : (profile == EmbossProfile::Flat ? height : 0.0));
    least = std::min(least, toSegment(p, last, next));
    last = next;
  }
  if (profile == EmbossProfile::Flat) least = std::min(least, toSegment(p, last, V2d(width, 0)));
  return p.y < height * unitHeight(profile, p.x / width) ? -least : least;
}

TEST(EmbossSection, IsTheDistanceToTheGraphOnBothSides) {
  std::mt19937 random(7);
  for (const EmbossProfile profile : kProfiles)
    for (const V2d& size : {V2d(6, 4), V2d(3, 12), V2d(20, 0.3)}) {
      const EmbossSection section(profile, size.x, size.y);
      double worst = 0;
      int inside = 0;
      constexpr int kPoints = 100;
      for (int i = 0; i < kPoints; ++i) {
        const V2d p(std::uniform_real_distribution(0.0, 1.5 * size.x)(random),
                    std::uniform_real_distribution(-4.0, size.y + 4)(random));
        const double found = section.distance(p.x, p.y);
        inside += found < 0;
        worst = std::max(worst, std::abs(found - fineDistance(profile, size.x, size.y, p)));
      }
      EXPECT_LT(worst, support::measured(5.05e-6)) << static_cast<int>(profile) << " " << size;
      EXPECT_GT(inside, kPoints / 10);
      EXPECT_LT(inside, kPoints * 9 / 10);
    }
}

TEST(EmbossSection, MirrorsNegativeHeights) {
  for (const EmbossProfile profile : kProfiles) {
    const EmbossSection up(profile, 5, 3), down(profile, 5, -3);
    for (double d = 0; d < 8; d += 0.37) {
      EXPECT_EQ(down.height(d), -up.height(d));
      for (double phi = -5; phi < 5; phi += 0.41)
        EXPECT_EQ(down.distance(d, -phi), -up.distance(d, phi));
    }
  }
}

TEST(EmbossSection, KeepsTheBitsOfDistancesBeyondTheWidth) {
  for (const EmbossProfile profile : kProfiles)
    for (const double height : {3.0, -3.0}) {
      const EmbossSection section(profile, 5, height);
      for (const double phi : {-2.1, -0.3, 0.0, 0.7, 1.9})
        EXPECT_EQ(section.distance(7.3, phi), phi) << static_cast<int>(profile);
      EXPECT_EQ(section.height(5), 0);
      EXPECT_EQ(section.height(0), height);
    }
}

TEST(EmbossCurve, IsTheDistanceToItsNearestSegment) {
  std::mt19937 random(3);
  const auto anywhere = [&] {
    std::uniform_real_distribution<double> in(-9, 9);
    return Vec3d(in(random), in(random), in(random));
  };
  Polyline line;
  for (int i = 0; i < 40; ++i) line.points.push_back(anywhere());
  for (const bool isJoined : {true, false}) {
    line.isJoined = isJoined;
    line.isClosed = isJoined;
    const EmbossCurve curve(line);
    for (int k = 0; k < 100; ++k) {
      const Vec3d p = anywhere();
      double least = 1e9;
      for (std::size_t i = 0; i < 40; ++i) {
        const Vec3d a = line.points[i], b = isJoined ? line.points[(i + 1) % 40] : a;
        for (int s = 0; s <= (isJoined ? 400 : 0); ++s)
          least = std::min(least, (a + s / 400.0 * (b - a) - p).length());
      }
      EXPECT_LE(curve.distance(p, 100), least);
      EXPECT_NEAR(curve.distance(p, 100), least, support::measured(2e-3));
      EXPECT_EQ(curve.distance(p, 0.5 * least), 0.5 * least);
    }
  }
}

TEST(EmbossCurve, PassesASplineThroughItsPoints) {
  Polyline ring{{}, true, true};
  constexpr int kPoints = 16;
  for (int i = 0; i < kPoints; ++i)
    ring.points.emplace_back(10 * std::cos(2 * pi * i / kPoints),
                             10 * std::sin(2 * pi * i / kPoints), 0);
  const Polyline fine = embossing::onSpline(ring, 1e-4);
  const EmbossCurve curve(fine);
  for (const Vec3d& p : ring.points) EXPECT_EQ(curve.distance(p, 1), 0);
  double worst = 0;
  for (const Vec3d& p : fine.points) worst = std::max(worst, std::abs(p.length() - 10));
  EXPECT_LT(worst, support::measured(0.0094));  // chords of the ring deviate by 0.19
  EXPECT_NEAR(curve.length(), 20 * pi, support::measured(0.0184));
  // Fewer than three points have no bend.
  EXPECT_EQ(embossing::onSpline({{Vec3d(0), Vec3d(1)}}, 1e-4).points.size(), 2u);
  // An open spline ends at its last point, and points on a line stay there.
  const Polyline straight = embossing::onSpline({{Vec3d(0), Vec3d(1, 2, 3), Vec3d(2, 4, 6)}}, 1e-4);
  EXPECT_EQ(straight.points.back(), Vec3d(2, 4, 6));
  EXPECT_EQ(straight.points.size(), 3u);
}

}  // namespace emboss_section_test
