// Quadrics as values: tight boxes, colours, refusals, memory.

#include "render/quadrics/quadric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "levelset/error.h"
#include "render/quadrics/quadric_caster.h"
#include "render/quadrics/quadric_part.h"
#include "tests/support/measured.h"
#include "tests/support/quadric_scenes.h"

namespace quadric_test {

using Imath::V3d;
using quadric_scenes::Numbers;
using namespace render;

double radiusAt(QuadricKind kind, double z) {
  switch (kind) {
    case QuadricKind::Ellipsoid:
      return std::sqrt(std::max(0.0, 1 - z * z));
    case QuadricKind::Cylinder:
      return 1;
    case QuadricKind::Cone:
      return std::abs(z);
    case QuadricKind::Paraboloid:
      return z >= 0 ? std::sqrt(z) : -1;
    case QuadricKind::OneSheet:
      return std::sqrt(1 + z * z);
    case QuadricKind::TwoSheet:
      return std::abs(z) >= 1 ? std::sqrt(z * z - 1) : -1;
  }
  return -1;
}

/// Calls use(point) with points of a quadric, dense along its height and around it.
template <typename Use>
void forPointsOf(const Quadric& quadric, int heights, int angles, const Use& use) {
  const bool isClosed = quadric.kind == QuadricKind::Ellipsoid;
  const double low = isClosed ? -1 : quadric.range.low, high = isClosed ? 1 : quadric.range.high;
  for (int i = 0; i <= heights; ++i) {
    const double z = low + (high - low) * i / heights, r = radiusAt(quadric.kind, z);
    if (r < 0) continue;
    for (int j = 0; j < angles; ++j) {
      const double angle = 2 * std::numbers::pi * j / angles;
      use(quadric.position + quadric.axes[0] * (r * std::cos(angle)) +
          quadric.axes[1] * (r * std::sin(angle)) + quadric.axes[2] * z);
    }
  }
}

TEST(QuadricBox, TouchesTheSurfaceOnAllSides) {
  Numbers numbers(1);
  double loosest = 0;
  for (int n = 0; n < 120; ++n) {
    const Quadric quadric = quadric_scenes::randomQuadric(static_cast<QuadricKind>(n % 6),
                                                          numbers.inBox(3), 8, numbers);
    const Imath::Box3d tight = boundsOf(quadric);
    Imath::Box3d sampled;
    forPointsOf(quadric, 700, 400, [&](const V3d& p) { sampled.extendBy(p); });
    const double size = tight.size().length();
    for (int c = 0; c < 3; ++c) {
      // No point is outside, beyond rounding.
      EXPECT_GE(sampled.min[c], tight.min[c] - 1e-14 * (size + 3));
      EXPECT_LE(sampled.max[c], tight.max[c] + 1e-14 * (size + 3));
      loosest = std::max({loosest, (sampled.min[c] - tight.min[c]) / size,
                          (tight.max[c] - sampled.max[c]) / size});
    }
  }
  EXPECT_LT(loosest, 1e-4) << "the distance of the samples";
}

TEST(QuadricBox, TouchesThePictureOnAllSides) {
  Numbers numbers(2);
  double outside = 0, loosest = 0;
  int boxes = 0;
  for (int n = 0; n < 300; ++n) {
    const Quadric quadric = quadric_scenes::randomQuadric(static_cast<QuadricKind>(n % 6),
                                                          numbers.inBox(0.5), 8, numbers);
    Camera camera;
    camera.from = numbers.unit() * numbers.between(4, 9);
    camera.up = camera.from.cross(numbers.unit()).normalized();
    camera.width = 640;
    camera.height = 480;
    if (n % 4 == 0) camera.orthoHeight = 6;
    const auto tight = pictureBox(quadric, camera);
    if (!tight) continue;
    ++boxes;
    const Imath::M44d toNdc = camera.worldToNdc();
    Imath::Box2d sampled;
    forPointsOf(quadric, 600, 300, [&](const V3d& p) {
      V3d at;
      toNdc.multVecMatrix(p, at);
      sampled.extendBy(Imath::V2d(at.x * camera.width, at.y * camera.height));
    });
    for (int c = 0; c < 2; ++c) {
      outside = std::max({outside, tight->min[c] - sampled.min[c], sampled.max[c] - tight->max[c]});
      loosest = std::max({loosest, sampled.min[c] - tight->min[c], tight->max[c] - sampled.max[c]});
    }
  }
  EXPECT_GT(boxes, 250);
  EXPECT_LT(outside, 1e-9) << "pixels";
  EXPECT_LT(loosest, support::measured(0.036)) << "pixels";
}

TEST(QuadricBox, ContainsAllPixelsAndNoEmptyBorder) {
  // The pixels that the caster draws, against the box: at most one pixel of it is empty on a side.
  Numbers numbers(3);
  for (int n = 0; n < 60; ++n) {
    const Quadric quadric =
        quadric_scenes::randomQuadric(static_cast<QuadricKind>(n % 6), V3d(0), 3, numbers);
    Quadric capped = quadric;
    capped.isCapped = true;
    Camera camera;
    camera.from = numbers.unit() * 7;
    camera.up = camera.from.cross(numbers.unit()).normalized();
    camera.width = camera.height = 96;
    const auto tight = pictureBox(capped, camera);
    if (!tight) continue;
    const QuadricCaster caster({{}, {}, {capped}});
    Imath::Box2d drawn;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        if (caster.firstHit(camera.ray(x + 0.5, y + 0.5)).found)
          drawn.extendBy(Imath::V2d(x + 0.5, y + 0.5));
    ASSERT_FALSE(drawn.isEmpty());
    for (int c = 0; c < 2; ++c) {
      if (tight->min[c] < 0 || tight->max[c] > 96) continue;
      EXPECT_LE(tight->min[c], drawn.min[c] + 1e-4);
      EXPECT_GE(tight->max[c], drawn.max[c] - 1e-4);
    }
  }
}

TEST(QuadricBox, HasTheHalfSizeOfTheSphereInPerspective) {
  // A sphere of radius 1 at distance 5 spans tan(asin(1/5)) of the focal length.
  Camera camera;
  camera.width = camera.height = 100;
  const auto box = pictureBox(quadricOf(Ball{V3d(0), 1, 0}), camera);
  ASSERT_TRUE(box);
  const double half = 50 / std::tan(0.5 * camera.verticalFov) * std::tan(std::asin(0.2));
  EXPECT_NEAR(box->max.x - 50, half, 1e-12 * 50);
  EXPECT_NEAR(50 - box->min.y, half, 1e-12 * 50);
  EXPECT_FALSE(pictureBox(quadricOf(Ball{V3d(0, 0, 4.5), 1, 0}), camera)) << "around the eye";
  EXPECT_FALSE(pictureBox(quadricOf(Ball{V3d(0, 0, 9), 1, 0}), camera)) << "behind the eye";
}

TEST(QuadricBox, IsThatOfTheSameSolidInCompactForm) {
  Numbers numbers(4);
  for (int n = 0; n < 50; ++n) {
    const Stick stick{numbers.inBox(2), numbers.inBox(2), static_cast<float>(numbers()), 0};
    const Imath::Box3d box = boundsOf(quadricOf(stick));
    const std::vector<double> extents =
        QuadricCaster({{}, {stick}, {}}).extents({V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, -1)});
    EXPECT_NEAR(extents[0], box.max.x, 1e-6);
    EXPECT_NEAR(extents[1], box.max.y, 1e-6);
    EXPECT_NEAR(extents[2], -box.min.z, 1e-6);
  }
}

TEST(QuadricModel, PacksColours) {
  for (const std::uint32_t colour : {0U, 0xffffffU, 0x123456U})
    EXPECT_EQ(packedColour(unpackedColour(colour)), colour);
  EXPECT_EQ(packedColour({2, -1, std::numeric_limits<float>::quiet_NaN()}), 0x0000ffU);
}

TEST(QuadricModel, RefusesWhatCannotBeDrawn) {
  const auto reasonOf = [](const QuadricModel& model) -> std::string {
    try {
      requireQuadrics(model);
    } catch (const levelset::InvalidInput& error) {
      return error.what();
    }
    return "";
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(reasonOf({}), "there is no quadric; give at least one");
  EXPECT_EQ(reasonOf({{{V3d(0), 1, 0}, {V3d(0), 0, 0}}, {}, {}}),
            "sphere 2 has the radius 0; give a positive one up to 1e15");
  EXPECT_NE(reasonOf({{{V3d(0, nan, 0), 1, 0}}, {}, {}}).find("sphere 1 has a centre"),
            std::string::npos);
  EXPECT_NE(reasonOf({{{V3d(2e15, 0, 0), 1, 0}}, {}, {}}).find("exceeds 1e15"), std::string::npos);
  EXPECT_EQ(reasonOf({{}, {{V3d(1), V3d(1), 1, 0}}, {}}),
            "cylinder 1 has ends at the same position; give two different ones");
  Quadric flat;
  flat.axes[2] = flat.axes[0] + flat.axes[1];
  EXPECT_EQ(reasonOf({{}, {}, {flat}}),
            "quadric 1 has axes in one plane; give three independent ones");
  Quadric empty;
  empty.axes[1] = V3d(0);
  EXPECT_EQ(reasonOf({{}, {}, {empty}}), "quadric 1 has an axis of length 0; give a longer one");
  Quadric turned;
  turned.kind = QuadricKind::Cone;
  turned.range = {1, -1};
  EXPECT_NE(reasonOf({{}, {}, {turned}}).find("the range 1 … -1"), std::string::npos);
  Quadric gap;
  gap.kind = QuadricKind::TwoSheet;
  gap.range = {-0.5, 0.5};
  EXPECT_NE(reasonOf({{}, {}, {gap}}).find("has none between -1 and 1"), std::string::npos);
}

TEST(QuadricModel, RefusesWhatSinglePrecisionCannotHold) {
  const QuadricModel model{{{V3d(1000, 0, 0), 1, 0}, {V3d(-1000, 0, 0), 1, 0}},
                           {{V3d(999, 0, 0), V3d(999 + 1e-6, 0, 0), 1, 0}},
                           {}};
  try {
    (void)QuadricCaster(model);
    ADD_FAILURE() << "no error";
  } catch (const levelset::InvalidInput& error) {
    EXPECT_NE(std::string(error.what()).find("single precision rounds to 0"), std::string::npos);
  }
  Quadric flat;
  flat.axes = {V3d(0.6, 0.8, 0), V3d(0.6 - 8e-9, 0.8 + 6e-9, 0), V3d(0, 0, 1)};
  EXPECT_THROW(requireQuadrics({{}, {}, {flat}}), levelset::InvalidInput);
  Quadric thin;
  thin.kind = QuadricKind::Cylinder;
  thin.range = {1, 1 + 1e-9};
  EXPECT_THROW(requireQuadrics({{}, {}, {thin}}), levelset::InvalidInput);
}

TEST(QuadricModel, NeedsTheStatedMemory) {
  Numbers numbers(7);
  const QuadricModel balls{quadric_scenes::ballsInCube(50'000, numbers), {}, {}};
  const QuadricCaster caster(balls);
  EXPECT_EQ(caster.count(), 50'000U);
  const double each = static_cast<double>(caster.bytes()) / 50'000;
  EXPECT_LT(each, 33);
  EXPECT_THROW(QuadricCaster(balls, 1'000'000), levelset::ResourceLimit);
}

TEST(QuadricModel, IsKeptByTheTables) {
  Numbers numbers(8);
  const QuadricPart part = makeQuadricPart(quadric_scenes::ballsInCube(100, numbers),
                                           quadric_scenes::sticksInCube(30, numbers));
  const QuadricModel model = part.caster.model();
  ASSERT_EQ(model.balls.size(), 100U);
  ASSERT_EQ(model.sticks.size(), 30U);
  // A second pass rounds nothing, except that the middle of the model may move.
  const QuadricModel again = QuadricCaster(model).model();
  for (std::size_t n = 0; n < 100; ++n) {
    EXPECT_LT((again.balls[n].centre - model.balls[n].centre).length(), 2e-7);
    EXPECT_EQ(again.balls[n].colour, model.balls[n].colour);
  }
}

}  // namespace quadric_test
