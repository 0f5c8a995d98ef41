#include "levelset/molecules/solids/molecule_solid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/molecules/solids/rod_union.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace molecule_solid_test {

using Imath::V3d;
using levelset::Ball;
using levelset::Molecule;
using levelset::moleculeSolid;
using levelset::MoleculeStyle;
using levelset::Rod;
using levelset::RodUnion;
using support::measured;
using support::refusal;

constexpr double kPi = std::numbers::pi;

TEST(RodUnion, OfADumbbellIsExact) {
  // Balls of 1 at ±2, a rod of 0.5 between them. In the half plane (x, r), the boundary consists of
  // an arc and a segment, which meet at a corner.
  const RodUnion solid({{V3d(-2, 0, 0), 1}, {V3d(2, 0, 0), 1}}, {{0, 1, 0.5}});
  const double corner = 2 - std::sqrt(0.75);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-3.5, 3.5);
  double worst = 0;
  int inside = 0;
  for (int n = 0; n < 4000; ++n) {
    const V3d p = V3d(place(random), place(random), place(random)) * (n % 3 ? 0.6 : 1);
    const double x = std::abs(p.x), r = std::hypot(p.y, p.z);
    const double toBall = std::hypot(x - 2, r) - 1, toRod = r - 0.5;
    double truth = std::min(toBall, x <= 2 ? toRod : toBall);
    if (truth < 0) {
      ++inside;
      // The foot on the sphere is exposed unless it lies in the rod, and the one on the rod unless
      // it lies in the ball.
      double least = std::hypot(x - corner, r - 0.5);
      const double scale = 1 / std::hypot(x - 2, r);
      if (toBall < 0 && !(r * scale < 0.5 && x < 2)) least = std::min(least, -toBall);
      if (toRod < 0 && x < corner) least = std::min(least, -toRod);
      truth = -least;
    }
    worst = std::max(worst, std::abs(solid.distance(p, 10) - truth));
  }
  EXPECT_GT(inside, 100);
  EXPECT_LT(worst, 1e-9);
}

TEST(RodUnion, OfAStraightChainIsExact) {
  // Three balls of 1, and rods of 0.5. The second chain has a bend far below the bound.
  for (const double bend : {0.0, 1e-11}) {
    const RodUnion solid({{V3d(-4, 0, 0), 1}, {V3d(0), 1}, {V3d(4, bend, 0), 1}},
                         {{0, 1, 0.5}, {1, 2, 0.5}});
    const double corner = std::sqrt(0.75);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> place(-1.5, 1.5);
    double worst = 0;
    int inside = 0;
    for (int n = 0; n < 2000; ++n) {
      // The half of the chain around the middle ball.
      const V3d p(1.3 * place(random), place(random), place(random));
      const double x = std::abs(p.x), r = std::hypot(p.y, p.z), centre = std::hypot(x, r);
      double truth = std::min(centre - 1, r - 0.5);
      if (truth < 0) {
        ++inside;
        double least = std::hypot(x - corner, r - 0.5);
        if (centre < 1 && r > 0.5 * centre) least = std::min(least, 1 - centre);
        if (r < 0.5 && x > corner) least = std::min(least, 0.5 - r);
        truth = -least;
      }
      worst = std::max(worst, std::abs(solid.distance(p, 10) - truth));
    }
    EXPECT_GT(inside, 250);
    EXPECT_LT(worst, 1e-9) << bend;
  }
}

TEST(RodUnion, RefusesRodsSideBySide) {
  const auto build = [](double turn, double apart) {
    const V3d along(3 * std::cos(turn), 3 * std::sin(turn), 0), side(0, apart, 0);
    RodUnion({{V3d(0), 0.3}, {V3d(3, 0, 0), 0.3}, {side, 0.3}, {side + along, 0.3}},
             {{0, 1, 0.3}, {2, 3, 0.3}});
  };
  const auto says = [&](double turn, double apart) {
    return refusal<levelset::InvalidInput>([&] { build(turn, apart); });
  };
  EXPECT_SAYS(says(0, 0.4), "side by side");
  EXPECT_SAYS(says(1e-3, 0.4), "side by side");
  EXPECT_SAYS(says(-1e-3, 0.4), "side by side");
  EXPECT_SAYS(says(1e-3, 0), "side by side");
  // They do not meet, or coincide.
  EXPECT_NO_THROW(build(0, 0.61));
  EXPECT_NO_THROW(build(0, 0));
  EXPECT_NO_THROW(build(0.2, 0.4));
}

/// Distance from points of the boundary of a union, spread over all balls and rods.
class SampledBoundary {
 public:
  SampledBoundary(const std::vector<Ball>& balls, const std::vector<Rod>& rods, int across) {
    const auto depth = [&](const V3d& p) {
      double least = std::numeric_limits<double>::infinity();
      for (const Ball& ball : balls)
        least = std::min(least, (p - ball.centre).length() - ball.radius);
      for (const Rod& rod : rods) {
        const V3d a = balls[rod.first].centre, along = balls[rod.second].centre - a;
        const double t = std::clamp((p - a).dot(along) / along.length2(), 0.0, 1.0);
        least = std::min(least, (p - a - along * t).length() - rod.radius);
      }
      return least;
    };
    const auto offer = [&](const V3d& p) {
      if (depth(p) > -1e-9) points_.push_back(p);
    };
    for (const Ball& ball : balls)
      for (int i = 0; i < across; ++i)
        for (int j = 0; j < 2 * across; ++j) {
          const double z = (2 * i + 1.0) / across - 1, ring = std::sqrt(1 - z * z),
                       a = kPi * j / across;
          offer(ball.centre + V3d(ring * std::cos(a), ring * std::sin(a), z) * ball.radius);
        }
    for (const Rod& rod : rods) {
      const V3d a = balls[rod.first].centre, along = balls[rod.second].centre - a;
      const V3d w = along.normalized(),
                u = w.cross(std::abs(w.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized(),
                v = w.cross(u);
      for (int i = 0; i < 3 * across; ++i)
        for (int j = 0; j < across; ++j) {
          const double angle = 2 * kPi * j / across;
          offer(a + along * ((i + 0.5) / (3 * across)) +
                (u * std::cos(angle) + v * std::sin(angle)) * rod.radius);
        }
    }
  }
  [[nodiscard]] double distance(const V3d& p) const {
    double least = std::numeric_limits<double>::infinity();
    for (const V3d& q : points_) least = std::min(least, (p - q).length2());
    return std::sqrt(least);
  }

 private:
  std::vector<V3d> points_;
};

TEST(SlowRodUnion, HasTheDistancesOfFineSamples) {
  // Balls as thick as the rods, small ones and large ones. Rods that meet at a ball, and some that
  // cross.
  for (const double ballRadius : {0.3, 0.36, 0.7}) {
    std::vector<Ball> balls;
    for (const V3d& p : {V3d(0), V3d(1.5, 0, 0), V3d(-0.5, 1.4, 0.1), V3d(-0.5, -0.7, 1.2),
                         V3d(1.9, 1.3, 0.4), V3d(0.6, -0.8, 0.25), V3d(0.7, 1.1, -0.1)})
      balls.push_back({p, ballRadius});
    const std::vector<Rod> rods = {
        {0, 1, 0.3}, {0, 2, 0.3}, {0, 3, 0.3}, {1, 4, 0.3}, {5, 6, 0.25}};
    const RodUnion solid(balls, rods);
    const SampledBoundary fine(balls, rods, 160);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> place(-0.9, 2);
    double worst = 0, excess = 0;
    int inside = 0;
    for (int n = 0; n < 400; ++n) {
      const V3d p(place(random), place(random), place(random) * 0.6);
      const double found = solid.distance(p, 10), sampled = fine.distance(p);
      inside += found < 0;
      // Samples are on the boundary, so that the distance is at most that of the closest one.
      excess = std::max(excess, std::abs(found) - sampled);
      worst = std::max(worst, sampled - std::abs(found));
    }
    EXPECT_GT(inside, 15);
    EXPECT_LT(excess, 2e-9) << ballRadius;
    EXPECT_LT(worst, measured(0.026)) << ballRadius;  // that of the samples
  }
}

/// A zigzag of carbon atoms with a bend of 112°.
Molecule zigzag(int count) {
  Molecule molecule{.residues = {{"UNK", 1, "", 0}}, .chains = {"A"}};
  for (int n = 0; n < count; ++n)
    molecule.atoms.push_back({.position = V3d(1.27 * n, n % 2 ? 0.86 : 0, 0.1 * n), .element = 6});
  return molecule;
}

TEST(MoleculeSolid, HasTheVolumeOfADumbbell) {
  Molecule two{.residues = {{"UNK", 1, "", 0}}, .chains = {"A"}};
  for (const double x : {0.0, 1.5}) two.atoms.push_back({.position = V3d(x, 0, 0), .element = 6});
  // Two balls of 0.425, and a rod of 0.15 without the caps inside the balls.
  const double ball = 0.425, rod = 0.15, reach = std::sqrt(ball * ball - rod * rod),
               cap = ball - reach;
  const double volume = 8 * kPi / 3 * ball * ball * ball + kPi * rod * rod * (1.5 - 2 * reach) -
                        2 * kPi * cap * cap * (3 * ball - cap) / 3;
  double last = 0;
  for (const auto& [voxel, figure] : {std::pair{0.06, 0.0115}, {0.03, 0.00285}, {0.015, 7.1e-4}}) {
    const auto made = moleculeSolid(two, voxel);
    EXPECT_EQ(made.bonds, 1u);
    const double error = std::abs(measure(bandToMesh(made.band)).volume / volume - 1);
    EXPECT_LT(error, measured(figure)) << voxel;
    if (last > 0) {
      EXPECT_GT(std::log2(last / error), 1.6) << voxel;
    }
    last = error;
  }
}

TEST(MoleculeSolid, OfBallsIsTheirUnion) {
  double last = 0;
  for (const auto& [voxel, figure] : {std::pair{0.2, 4.3e-3}, {0.1, 1.06e-3}, {0.05, 2.7e-4}}) {
    const auto made = moleculeSolid(zigzag(6), voxel, {.style = MoleculeStyle::VanDerWaals});
    EXPECT_EQ(made.bonds, 0u);
    const double error = std::abs(measure(bandToMesh(made.band)).volume / made.volume - 1);
    EXPECT_LT(error, measured(figure)) << voxel;
    if (last > 0) {
      EXPECT_GT(std::log2(last / error), 1.6) << voxel;
    }
    last = error;
  }
  const auto small = moleculeSolid(zigzag(4), 0.05, {.style = MoleculeStyle::Balls});
  EXPECT_NEAR(small.volume, 4 * 4 * kPi / 3 * std::pow(0.425, 3), 1e-9);
}

TEST(MoleculeSolid, HasTheSameBitsOnAnyNumberOfThreads) {
  for (const MoleculeStyle style : {MoleculeStyle::Sticks, MoleculeStyle::BallAndStick}) {
    const auto hash = [&] {
      return moleculeSolid(zigzag(20), 0.05, {.style = style}).band.contentHash();
    };
    EXPECT_EQ(support::onThreads(1, hash), support::onThreads(7, hash));
  }
}

TEST(MoleculeSolid, Refuses) {
  using levelset::InvalidInput;
  EXPECT_SAYS(refusal<InvalidInput>([] { (void)moleculeSolid({}, 0.1); }), "no atoms");
  EXPECT_FALSE(refusal<InvalidInput>([] { (void)moleculeSolid(zigzag(2), 50); }).empty());
  EXPECT_FALSE(refusal<levelset::ResourceLimit>([] {
                 (void)moleculeSolid(zigzag(50), 0.01, {}, {.maxMemory = 1'000'000});
               }).empty());
  EXPECT_SAYS(refusal<InvalidInput>([] {
                RodUnion({{V3d(0), 1}, {V3d(3), 1}}, {{0, 1, 1.5}});
              }),
              "thicker");
  EXPECT_SAYS(refusal<levelset::UsageError>(
                  [] { (void)moleculeSolid(zigzag(2), 0.1, {.stickRadius = 3.1}); }),
              "at most 3");
  EXPECT_SAYS(refusal<InvalidInput>([] { RodUnion({}, {}); }), "no ball");
}

}  // namespace molecule_solid_test
