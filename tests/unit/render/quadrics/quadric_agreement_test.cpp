// Ray casting of quadrics: agreement with the judge and with analytic truth.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "render/embree/quadrics/quadric_judge.h"
#include "render/quadrics/quadric_caster.h"
#include "render/quadrics/quadric_tables.h"
#include "render/quadrics/quadric_trace.h"
#include "tests/support/measured.h"
#include "tests/support/quadric_scenes.h"
#include "tests/support/threads.h"

namespace quadric_agreement_test {

using Imath::V3d;
using quadric_scenes::Numbers;
using namespace render;

/// Differences of the kernel and the judge over the rays of cameras.
struct Differences {
  std::size_t rays = 0, hits = 0, oneOnly = 0, within = 0;
  double distance = 0;  ///< largest, as a share of the diagonal
  double normal = 0;    ///< largest length of a difference of normals where both faces agree
};

void compare(const QuadricCaster& caster, const Camera& camera, Differences& all) {
  const QuadricJudge judge(caster.model());
  const double diagonal = caster.bounds().size().length();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Camera::Ray ray = camera.ray(x + 0.5, y + 0.5);
      const QuadricHit found = caster.firstHit(ray);
      const JudgedQuadric judged = judge.firstHit(ray);
      ++all.rays;
      all.hits += judged.found;
      all.oneOnly += found.found != judged.found;
      if (!found.found || !judged.found) continue;
      // Near a silhouette, the distance depends on the rounding of the position by a root.
      const double steep = std::abs(judged.normal.dot(ray.direction));
      all.distance =
          std::max(all.distance, std::abs(found.distance - judged.distance) * steep / diagonal);
      const double turned = (found.normal - judged.normal).length();
      if (turned < 0.5) all.normal = std::max(all.normal, turned * steep);
      all.within += judged.normal.dot(ray.direction) > 0;
    }
}

/// Cameras around a model, one of them inside its box.
std::vector<Camera> camerasOf(const QuadricCaster& caster, int size, Numbers& numbers) {
  const Imath::Box3d box = caster.bounds();
  const double radius = 0.5 * box.size().length();
  std::vector<Camera> cameras;
  for (int n = 0; n < 5; ++n) {
    Camera camera;
    camera.width = camera.height = size;
    camera.to = box.center();
    const V3d away = numbers.unit();
    camera.from = camera.to + away * (radius * (n == 4 ? 0.05 : numbers.between(2, 4)));
    camera.up = away.cross(numbers.unit()).normalized();
    if (n == 3) camera.orthoHeight = 2 * radius;
    cameras.push_back(camera);
  }
  return cameras;
}

class QuadricKinds : public testing::TestWithParam<int> {};

Differences differencesOf(QuadricKind kind, std::size_t count, double ratio, const V3d& position,
                          int size) {
  Numbers numbers(17 + static_cast<std::uint64_t>(kind));
  Differences all;
  for (std::size_t n = 0; n < count; ++n) {
    const QuadricModel model{
        {}, {}, {quadric_scenes::randomQuadric(kind, position, ratio, numbers)}};
    const QuadricCaster caster(model);
    for (const Camera& camera : camerasOf(caster, size, numbers)) compare(caster, camera, all);
  }
  return all;
}

TEST_P(QuadricKinds, AgreeWithTheJudge) {
  const Differences all = differencesOf(static_cast<QuadricKind>(GetParam()), 20, 3, V3d(0), 24);
  EXPECT_EQ(all.oneOnly, 0U);
  EXPECT_GT(all.hits, all.rays / 5);
  EXPECT_GT(all.within, all.rays / 50);
  EXPECT_LT(all.distance, support::measured(7e-16));
  EXPECT_LT(all.normal, 7e-14);
}

TEST_P(QuadricKinds, AgreeFarFromTheOrigin) {
  const Differences all =
      differencesOf(static_cast<QuadricKind>(GetParam()), 10, 3, V3d(1e6, -7e5, 1e6), 24);
  EXPECT_EQ(all.oneOnly, 0U);
  EXPECT_GT(all.hits, all.rays / 5);
  EXPECT_LT(all.distance, support::measured(7e-16));
}

TEST_P(QuadricKinds, AgreeIfTheyAreFlat) {
  const Differences all = differencesOf(static_cast<QuadricKind>(GetParam()), 10, 1e4, V3d(0), 24);
  EXPECT_EQ(all.oneOnly, 0U);
  EXPECT_GT(all.hits, all.rays / 10);
  EXPECT_LT(all.distance, support::measured(7e-16));
}

INSTANTIATE_TEST_SUITE_P(All, QuadricKinds, testing::Range(0, kQuadricKinds));

TEST(SlowQuadricKinds, ThousandAgreeWithTheJudge) {
  // A third of them have axes of equal length, a third ratios up to 1e4, a third lie far away.
  for (int n = 0; n < kQuadricKinds; ++n) {
    SCOPED_TRACE(n);
    const auto kind = static_cast<QuadricKind>(n);
    for (const Differences& all :
         {differencesOf(kind, 334, 1, V3d(0), 32), differencesOf(kind, 333, 1e4, V3d(0), 32),
          differencesOf(kind, 333, 3, V3d(1e6, 1e6, -1e6), 32)}) {
      EXPECT_EQ(all.oneOnly, 0U);
      EXPECT_GT(all.hits, all.rays / 10);
    }
  }
}

TEST(QuadricCaster, FindsTheNearestOfMany) {
  Numbers numbers(5);
  QuadricModel model{
      quadric_scenes::ballsInCube(700, numbers), quadric_scenes::sticksInCube(600, numbers), {}};
  for (int n = 0; n < 60; ++n)
    model.quadrics.push_back(quadric_scenes::randomQuadric(static_cast<QuadricKind>(n % 6),
                                                           numbers.inBox(1), 3, numbers));
  for (Quadric& quadric : model.quadrics)
    for (V3d& axis : quadric.axes) axis *= 0.1;
  const QuadricCaster caster(model);
  Differences all;
  for (const Camera& camera : camerasOf(caster, 40, numbers)) compare(caster, camera, all);
  EXPECT_EQ(all.oneOnly, 0U);
  EXPECT_GT(all.hits, all.rays / 3);
  EXPECT_LT(all.distance, support::measured(7e-16));
}

TEST(QuadricCaster, HasTheBitsOfATestOfAllOnBothInstructionSets) {
  Numbers numbers(6);
  const QuadricModel model{
      quadric_scenes::ballsInCube(3000, numbers), quadric_scenes::sticksInCube(2000, numbers), {}};
  const QuadricCaster caster(model);
  const QuadricTables& tables = *caster.tables();
  std::size_t hits = 0;
  for (int n = 0; n < 2000; ++n) {
    const Camera::Ray ray{numbers.inBox(1.5), numbers.unit(), 0, numbers.between(0.1, 3)};
    const QuadricKernel::QuadricRay from = relativeRay(tables, ray);
    NearestQuadric expected;
    for (std::size_t slot = 0; slot < tables.slotCount(); ++slot) {
      const double t = tables.rootIn(slot, from).t;
      if (t <= ray.far && t < expected.t)
        expected = {.t = t, .slot = static_cast<std::uint32_t>(slot)};
    }
    for (const bool isWide : {false, true}) {
      if (isWide && !hasWideVectors()) continue;
      const NearestQuadric found = traceQuadrics(tables, ray, false, isWide);
      EXPECT_EQ(found.slot, expected.slot);
      EXPECT_EQ(found.t, expected.t);
      EXPECT_EQ(traceQuadrics(tables, ray, true, isWide).slot != NearestQuadric::kNoSlot,
                expected.slot != NearestQuadric::kNoSlot);
    }
    hits += expected.slot != NearestQuadric::kNoSlot;
  }
  EXPECT_GT(hits, 500U);
  EXPECT_LT(hits, 1950U);
}

TEST(QuadricCaster, HasTheBitsOfSingleRaysForSeveral) {
  Numbers numbers(8);
  QuadricModel model{
      quadric_scenes::ballsInCube(3000, numbers), quadric_scenes::sticksInCube(3000, numbers), {}};
  for (int n = 0; n < 30; ++n) {
    model.quadrics.push_back(quadric_scenes::randomQuadric(static_cast<QuadricKind>(n % 6),
                                                           numbers.inBox(1), 3, numbers));
    for (V3d& axis : model.quadrics.back().axes) axis *= 0.2;
  }
  const QuadricCaster caster(model);
  std::vector<Camera> cameras = camerasOf(caster, 60, numbers);
  cameras.emplace_back();  // along an axis, so that directions of a square differ in sign
  cameras.back().width = cameras.back().height = 60;
  cameras.push_back(cameras.back());
  cameras.back().orthoHeight = 3;
  std::vector<Camera::Ray> rays;
  for (const Camera& camera : cameras)
    for (int n = 0; n < 3600; ++n) {  // squares of four by four pixels
      const int square = n / 16, x = square % 15 * 4 + n % 4, y = square / 15 * 4 + n % 16 / 4;
      rays.push_back(camera.ray(x + 0.5, y + 0.5));
      if (n % 7 == 0) rays.back().near = numbers.between(0, 4);
      if (n % 5 == 0) rays.back().far = numbers.between(0, 5);
    }
  for (int n = 0; n < 1003; ++n)
    rays.push_back({numbers.inBox(1.5), numbers.unit(), 0, numbers.between(0.1, 3)});
  std::size_t hits = 0, together = 0;
  for (const bool isWide : {false, true}) {
    if (isWide && !hasWideVectors()) continue;
    for (std::size_t first = 0; first < rays.size(); first += kBeamRays) {
      const auto some =
          std::span(rays).subspan(first, std::min<std::size_t>(kBeamRays, rays.size() - first));
      std::array<NearestQuadric, kBeamRays> found;
      together += traceQuadricBeam(*caster.tables(), some, isWide, found.data());
      for (std::size_t n = 0; n < some.size(); ++n) {
        const NearestQuadric alone = traceQuadrics(*caster.tables(), some[n], false, isWide);
        ASSERT_EQ(found[n].slot, alone.slot);
        EXPECT_EQ(found[n].t, alone.t);
        EXPECT_EQ(found[n].face, alone.face);
        hits += alone.slot != NearestQuadric::kNoSlot;
      }
    }
  }
  EXPECT_GT(hits, rays.size() / 2);
  EXPECT_GT(together, rays.size() / kBeamRays / 2) << "the others are traced one by one";
  const std::vector<QuadricHit> all = caster.firstHits(rays);
  for (std::size_t n = 0; n < rays.size(); ++n) {
    const QuadricHit alone = caster.firstHit(rays[n]);
    ASSERT_EQ(all[n].found, alone.found);
    EXPECT_EQ(all[n].distance, alone.distance);
    EXPECT_EQ(all[n].normal, alone.normal);
    EXPECT_EQ(all[n].slot, alone.slot);
  }
}

TEST(QuadricCaster, HasTheBitsOfSingleRaysForAFewAlongACylinder) {
  // Rays along the axis of a flat cylinder meet its sides nowhere, or everywhere.
  QuadricModel model;
  model.sticks.push_back({V3d(0, 0, -0.01), V3d(0, 0, 0.01), 0.5f});
  const QuadricCaster caster(model);
  for (const bool isWide : {false, true}) {
    if (isWide && !hasWideVectors()) continue;
    for (std::size_t count = 4; count <= kBeamRays; ++count)
      for (const double left : {-0.52, -0.4, 0.1, 0.4}) {
        std::vector<Camera::Ray> rays;
        for (std::size_t n = 0; n < count; ++n)
          rays.push_back({V3d(left + 0.03 * double(n % 4), 0.03 * double(n / 4), 2), V3d(0, 0, -1),
                          0, n % 3 == 2 ? 1.0 : 10.0});
        std::array<NearestQuadric, kBeamRays> found;
        traceQuadricBeam(*caster.tables(), rays, isWide, found.data());
        for (std::size_t n = 0; n < count; ++n) {
          const NearestQuadric alone = traceQuadrics(*caster.tables(), rays[n], false, isWide);
          ASSERT_EQ(found[n].slot, alone.slot) << count << ' ' << left << ' ' << n;
          EXPECT_EQ(found[n].t, alone.t);
        }
      }
  }
}

TEST(QuadricCaster, HasTheSameExtentsOnAnyNumberOfThreads) {
  Numbers numbers(11);
  const QuadricModel model{
      quadric_scenes::ballsInCube(30000, numbers), quadric_scenes::sticksInCube(9000, numbers), {}};
  std::vector<V3d> directions;
  for (int n = 0; n < 20; ++n) directions.push_back(numbers.unit());
  const auto extents = [&] { return QuadricCaster(model).extents(directions); };
  const std::vector<double> one = support::onThreads(1, extents);
  EXPECT_EQ(support::onThreads(7, extents), one);
  for (std::size_t n = 0; n < directions.size(); ++n) {
    double most = -1e300;
    for (const Ball& ball : model.balls)
      most = std::max(most, ball.centre.dot(directions[n]) + static_cast<double>(ball.radius));
    EXPECT_GE(one[n], most - 1e-7) << "single precision rounds centres";
  }
}

TEST(QuadricCaster, MeetsTheSphereAtItsRoots) {
  const QuadricCaster caster({{{V3d(1, 2, 3), 2, packedColour({1, 0, 0.5f})}}, {}, {}});
  const QuadricHit front = caster.firstHit({V3d(1, 2, -7), V3d(0, 0, 1)});
  EXPECT_EQ(front.distance, 8);
  EXPECT_EQ(front.normal, V3d(0, 0, -1));
  EXPECT_EQ(caster.colourOf(front), unpackedColour(packedColour({1, 0, 0.5f})));
  const QuadricHit within = caster.firstHit({V3d(1, 2, 3), V3d(0, 1, 0)});
  EXPECT_EQ(within.distance, 2);
  EXPECT_EQ(within.normal, V3d(0, 1, 0));
  EXPECT_EQ(caster.firstHit({V3d(1, 2, -7), V3d(0, 0, 1), 9}).distance, 12);
  EXPECT_FALSE(caster.firstHit({V3d(1, 2, -7), V3d(0, 0, 1), 0, 7}).found);
  EXPECT_FALSE(caster.firstHit({V3d(1, 2, -7), V3d(0, 0, -1)}).found) << "it is behind the eye";
  EXPECT_FALSE(caster.firstHit({V3d(1, 2, 6), V3d(0, 0, 1)}).found);
  EXPECT_TRUE(caster.isOccluded({V3d(1, 2, -7), V3d(0, 0, 1), 0, 8.5}));
  EXPECT_FALSE(caster.isOccluded({V3d(1, 2, -7), V3d(0, 0, 1), 0, 7.5}));
}

TEST(QuadricCaster, MeetsCapsOnlyWhereThereAreSome) {
  Quadric cone;
  cone.kind = QuadricKind::Cone;
  cone.range = {0, 2};
  const Camera::Ray up{V3d(0.5, 0, 5), V3d(0, 0, -1)};
  const QuadricHit onCap = QuadricCaster({{}, {}, {cone}}).firstHit(up);
  EXPECT_EQ(onCap.distance, 3);
  EXPECT_EQ(onCap.normal, V3d(0, 0, 1));
  cone.isCapped = false;
  const QuadricHit inside = QuadricCaster({{}, {}, {cone}}).firstHit(up);
  EXPECT_EQ(inside.distance, 4.5);
  EXPECT_LT((inside.normal - V3d(1, 0, -1).normalized()).length(), 1e-15);
  const QuadricCaster stick({{}, {{V3d(0), V3d(0, 0, 3), 1, 0}}, {}});
  EXPECT_EQ(stick.firstHit(up).distance, 2);
  EXPECT_EQ(stick.firstHit({V3d(0.5, 0, 1), V3d(0, 0, -1)}).distance, 1) << "from within";
  EXPECT_EQ(stick.firstHit({V3d(-4, 0, 1), V3d(1, 0, 0)}).normal, V3d(-1, 0, 0));
  EXPECT_FALSE(stick.firstHit({V3d(-4, 0, 3.001), V3d(1, 0, 0)}).found);
}

}  // namespace quadric_agreement_test
