#include "render/bezier/trims/trim_region.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <string>

#include "levelset/error.h"
#include "render/bezier/bezier_judge.h"
#include "render/bezier/shared_tree.h"
#include "tests/support/bezier_scenes.h"

namespace {

using bezier_scenes::Numbers;
using bezier_scenes::trimCircle;
using Imath::V2d;
using Imath::V3d;
using render::TrimLoop;
using render::TrimRegion;

std::string refusal(const TrimLoop& loop) {
  try {
    (void)TrimRegion({loop});
  } catch (const levelset::InvalidInput& error) {
    return error.what();
  }
  return "";
}

TEST(TrimRegion, ACircleOfRationalArcsIsADisc) {
  const V2d centre(0.4, 0.6);
  const TrimRegion disc({trimCircle(centre, 0.3)});
  Numbers numbers(1);
  for (int n = 0; n < 20000; ++n) {
    const V2d p(numbers(), numbers());
    const double beyond = (p - centre).length() - 0.3;
    if (std::abs(beyond) < 1e-14) continue;
    ASSERT_EQ(disc.contains(p), beyond < 0) << p;
  }
  // Next to the circle, where halving must go on to the last bits.
  for (int n = 0; n < 2000; ++n) {
    const double angle = 3.2 * numbers();
    const V2d direction(std::cos(angle), std::sin(angle));
    ASSERT_TRUE(disc.contains(centre + direction * (0.3 - 1e-14)));
    ASSERT_FALSE(disc.contains(centre + direction * (0.3 + 1e-14)));
  }
}

TEST(TrimRegion, RaysThroughVerticesAndAlongSidesCrossOnce) {
  const TrimRegion square({render::polylineLoop({{0, 0}, {1, 0}, {1, 1}, {0.5, 0.5}, {0, 1}})});
  for (const double v : {0.25, 0.5, 0.75}) {
    EXPECT_FALSE(square.contains({-0.1, v}));
    EXPECT_TRUE(square.contains({0.1, v}));
    EXPECT_FALSE(square.contains({1.1, v}));
  }
  EXPECT_FALSE(square.contains({0.5, 0.75}));
  EXPECT_FALSE(square.contains({-0.5, 0}));
  EXPECT_FALSE(square.contains({1.5, 0}));
  EXPECT_FALSE(square.contains({-0.5, 1}));
}

TEST(TrimRegion, LoopsInLoopsAlternateWhateverTheirDirections) {
  for (const bool turns : {false, true}) {
    const TrimRegion rings(
        {trimCircle(V2d(0), 3), trimCircle(V2d(0), 2, turns), trimCircle(V2d(0), 1, !turns)});
    EXPECT_TRUE(rings.contains({0.3, 0.2}));
    EXPECT_FALSE(rings.contains({1.3, 0.2}));
    EXPECT_TRUE(rings.contains({-2.3, 0.2}));
    EXPECT_FALSE(rings.contains({3.3, 0.2}));
  }
}

TEST(TrimRegion, AgreesWithWindingAngles) {
  const auto region = bezier_scenes::trimmedSurface().patches[0].trim->region;
  Numbers numbers(2);
  int inside = 0;
  for (int n = 0; n < 5000; ++n) {
    const V2d p = V2d(0.5) + V2d(numbers(), numbers()) * 0.5;
    const bool isInside = region->contains(p);
    inside += isInside;
    ASSERT_EQ(isInside, render::judgedContains(region->loops(), p)) << p;
  }
  EXPECT_GT(inside, 2000);
  EXPECT_LT(inside, 4000);
}

/// A curve that turns back in v several times, beside one of the highest degree.
TEST(TrimRegion, FindsAllTurnsOfACurve) {
  TrimLoop loop{{{V2d(0, 0), V2d(1, 3), V2d(2, -3), V2d(3, 3), V2d(4, -3), V2d(5, 0)},
                 {1, 3, 0.5, 2, 0.7, 1}},
                {{}, {}}};
  Numbers numbers(3);
  loop[1].points.push_back(V2d(5, 0));
  for (int n = 0; n < 19; ++n) loop[1].points.emplace_back(5 - 0.25 * n, -3 + 2 * numbers());
  loop[1].points.push_back(V2d(0, 0));
  const TrimRegion region({loop});
  int inside = 0;
  for (int n = 0; n < 3000; ++n) {
    const V2d p(2.5 + 3 * numbers(), -0.5 + 2 * numbers());
    inside += region.contains(p);
    ASSERT_EQ(region.contains(p), render::judgedContains({loop}, p)) << p;
  }
  EXPECT_GT(inside, 300);
}

TEST(TrimRegion, RefusesWhatIsNoLoop) {
  EXPECT_NE(refusal({}).find("has no curves"), std::string::npos);
  EXPECT_NE(refusal({{{V2d(0), V2d(1, 0)}, {}}}).find("is not closed"), std::string::npos);
  EXPECT_NE(refusal({{{V2d(0)}, {}}}).find("1 control points"), std::string::npos);
  EXPECT_NE(refusal({{{V2d(0), V2d(1, NAN), V2d(0)}, {}}}).find("finite"), std::string::npos);
  EXPECT_NE(refusal({{{V2d(0), V2d(1, 1), V2d(0)}, {1, 0, 1}}}).find("weight"), std::string::npos);
  EXPECT_NE(refusal({{{V2d(0), V2d(1, 1), V2d(0)}, {1, 1}}}).find("2 weights"), std::string::npos);
}

/// A square in space, cut to a ring: pixels are hit exactly where the plane is in the ring.
TEST(TrimmedSurface, ARingInAPlaneIsHitExactly) {
  render::BezierVolume volume;
  volume.patches.push_back(
      render::surfacePatch(1, 1, {V3d(-1, -1, 0), V3d(-1, 1, 0), V3d(1, -1, 0), V3d(1, 1, 0)}));
  const auto ring = std::make_shared<const TrimRegion>(
      std::vector<TrimLoop>{trimCircle(V2d(0.5), 0.4), trimCircle(V2d(0.5), 0.15)});
  volume.patches[0].trim = std::make_shared<const render::PatchTrim>(render::PatchTrim{ring});
  Numbers numbers(4);
  std::size_t hits = 0, rays = 0;
  for (int n = 0; n < 4; ++n) {
    const render::Camera camera = bezier_scenes::randomCamera(volume, numbers, 64);
    const render::BezierPicture picture = castBezier(volume, camera);
    EXPECT_EQ(picture.counts.overruns, 0U);
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x, ++rays) {
        const render::Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
        const V3d p = ray.origin - ray.direction * (ray.origin.z / ray.direction.z);
        const double radius = std::hypot(p.x, p.y);
        if (std::abs(radius - 0.8) < 1e-9 || std::abs(radius - 0.3) < 1e-9) continue;
        const std::size_t pixel = static_cast<std::size_t>(64 * y + x);
        const render::BezierRoot* hit = picture.nearest(pixel);
        ASSERT_EQ(hit != nullptr, radius > 0.3 && radius < 0.8) << n << ": " << x << ", " << y;
        if (!hit) continue;
        ++hits;
        EXPECT_NEAR((ray.origin + ray.direction * hit->distance - p).length(), 0, 1e-12);
      }
  }
  EXPECT_GT(hits, rays / 20);
}

}  // namespace
