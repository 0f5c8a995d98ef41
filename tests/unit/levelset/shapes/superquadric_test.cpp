#include "levelset/shapes/superquadric.h"

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
#include "levelset/shapes/spherical_product.h"
#include "tests/support/files.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace superquadric_test {

using Imath::V3d;
using levelset::makeSuperquadric;
using levelset::makeSupershape;
using levelset::NarrowBand;
using levelset::SphericalProduct;
using levelset::Superformula;
using support::measured;
using support::refusal;

constexpr double kPi = std::numbers::pi;

Superformula superellipse(double exponent) {
  return {4, V3d(2 / exponent)};
}

/// Surface points at a grid of angles, and searches on ever finer grids around the closest ones.
class FineSampling {
 public:
  explicit FineSampling(const SphericalProduct& surface) : surface_(surface) {
    for (int i = 0; i < kAround; ++i)
      for (int j = 0; j <= kUpright; ++j) points_.push_back(surface.at(theta(i), phi(j)));
  }

  [[nodiscard]] double distance(const V3d& p) const {
    std::vector<std::pair<double, int>> order;
    for (std::size_t n = 0; n < points_.size(); ++n)
      order.emplace_back((points_[n] - p).length2(), static_cast<int>(n));
    std::partial_sort(order.begin(), order.begin() + 40, order.end());
    double best = std::numeric_limits<double>::infinity();
    std::vector<std::pair<int, int>> tried;
    for (int n = 0; n < 40; ++n) {
      const int i = order[static_cast<std::size_t>(n)].second / (kUpright + 1),
                j = order[static_cast<std::size_t>(n)].second % (kUpright + 1);
      // Points beside one that was tried belong to the same minimum.
      const bool isBeside = std::any_of(tried.begin(), tried.end(), [&](const auto& t) {
        return std::abs(t.first - i) <= 2 && std::abs(t.second - j) <= 2;
      });
      if (isBeside) continue;
      tried.emplace_back(i, j);
      best = std::min(best, zoom(p, theta(i), phi(j)));
      if (tried.size() == 4) break;
    }
    return best;
  }

 private:
  static constexpr int kAround = 480, kUpright = 240;
  static double theta(int i) { return -kPi + 2 * kPi * i / kAround; }
  static double phi(int j) { return -kPi / 2 + kPi * j / kUpright; }

  [[nodiscard]] double zoom(const V3d& p, double theta, double phi) const {
    double best = std::numeric_limits<double>::infinity();
    constexpr int kHalf = 7;
    for (double width = 4 * kPi / kAround; width > 1e-11; width *= 0.35) {
      double bestTheta = theta, bestPhi = phi;
      for (int i = -kHalf; i <= kHalf; ++i)
        for (int j = -kHalf; j <= kHalf; ++j) {
          const double t = theta + width * i / kHalf,
                       f = std::clamp(phi + width * j / kHalf, -kPi / 2, kPi / 2);
          const double squared = (surface_.at(t, f) - p).length2();
          if (squared < best) {
            best = squared;
            bestTheta = t;
            bestPhi = f;
          }
        }
      theta = bestTheta;
      phi = bestPhi;
    }
    return std::sqrt(best);
  }

  const SphericalProduct& surface_;
  std::vector<V3d> points_;
};

/// Largest error of distances near a surface against fine sampling.
double worstError(const SphericalProduct& surface, double size, int count) {
  const FineSampling fine(surface);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-0.6 * size, 0.6 * size);
  double worst = 0;
  for (int n = 0, near = 0; near < count && n < 100 * count; ++n) {
    const V3d p(place(random), place(random), place(random));
    const double reach = 0.1 * size, found = surface.distance(p, reach);
    if (std::abs(found) > reach) continue;
    ++near;
    worst = std::max(worst, std::abs(std::abs(found) - fine.distance(p)) / size);
  }
  return worst;
}

TEST(SlowSuperquadric, HasTheDistancesOfFineSamples) {
  double worst = 0;
  for (const double vertical : {0.1, 0.6, 1.0, 1.7, 2.0, 4.0})
    for (const double horizontal : {0.1, 1.3, 3.0}) {
      const SphericalProduct surface(superellipse(horizontal), superellipse(vertical),
                                     V3d(1, 0.7, 0.8));
      const double error = worstError(surface, 2, 6);
      // Exponents above 2 have cusps.
      EXPECT_LT(error, std::max(vertical, horizontal) > 2 ? measured(5.5e-8) : 1e-8)
          << vertical << ' ' << horizontal;
      worst = std::max(worst, error);
    }
  RecordProperty("worst", std::to_string(worst));
}

TEST(Superquadric, OfExponentsOneIsABall) {
  const NarrowBand band = makeSuperquadric(V3d(2), 1, 1, V3d(0.1, 0.2, 0.3), 0.05);
  const NarrowBand ball = levelset::makeSphere(1, V3d(0.1, 0.2, 0.3), 0.05);
  EXPECT_EQ(band.activeVoxelCount(), ball.activeVoxelCount());
  const SphericalProduct surface(superellipse(1), superellipse(1), V3d(1));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(-1.2, 1.2);
  double worst = 0;
  for (int n = 0; n < 300; ++n) {
    V3d p(place(random), place(random), place(random));
    if (n % 5 == 0) p = V3d(0, 0, p.z);
    if (n % 7 == 0) p = V3d(p.x, 0, 0);
    const double truth = p.length() - 1;
    if (std::abs(truth) < 0.3) worst = std::max(worst, std::abs(surface.distance(p, 0.3) - truth));
  }
  EXPECT_LT(worst, 1e-10);
}

TEST(Superquadric, OfExponentsTwoIsAnOctahedron) {
  // Above the middle of a face, beside an edge and beside a corner.
  const SphericalProduct surface(superellipse(2), superellipse(2), V3d(1));
  const double face = 1 / std::sqrt(3);
  EXPECT_NEAR(surface.distance(V3d(0.4), 1), (0.4 * 3 - 1) * face, 1e-10);
  EXPECT_NEAR(surface.distance(V3d(0.3), 1), (0.3 * 3 - 1) * face, 1e-10);
  EXPECT_NEAR(surface.distance(V3d(0.7, 0.7, 0), 1), 0.4 / std::sqrt(2), 1e-9);
  EXPECT_NEAR(surface.distance(V3d(0, 0, 1.3), 1), 0.3, 1e-9);
  EXPECT_NEAR(surface.distance(V3d(-1.3, 0, 0), 1), 0.3, 1e-9);
}

TEST(SlowSuperquadric, HasTheVolumeOfTheBetaFunctions) {
  EXPECT_NEAR(levelset::superquadricVolume(V3d(2, 4, 6), 1, 1), 8 * kPi, 1e-12);
  EXPECT_NEAR(levelset::superquadricVolume(V3d(2), 2, 2), 4.0 / 3, 1e-12);
  // Orders at three resolutions.
  for (const auto& [vertical, horizontal, most] :
       {std::tuple{0.5, 0.5, 0.3}, std::tuple{0.8, 1.4, 0.5}, std::tuple{2.0, 1.0, 1.5}}) {
    const V3d size(2, 1.6, 1.2);
    const double volume = levelset::superquadricVolume(size, vertical, horizontal);
    double last = 0;
    for (const double voxel : {0.16, 0.08, 0.04}) {
      const double error = std::abs(
          measure(bandToMesh(makeSuperquadric(size, vertical, horizontal, V3d(0), voxel))).volume /
              volume -
          1);
      EXPECT_LT(error, most * voxel * voxel / 0.04)
          << vertical << ' ' << horizontal << ' ' << voxel;
      if (last > 0) {
        EXPECT_GT(std::log2(last / error), 1.6) << vertical << ' ' << voxel;
      }
      last = error;
    }
  }
}

TEST(Superquadric, MirrorsAndScalesWithItsSize) {
  const SphericalProduct surface(superellipse(0.4), superellipse(1.5), V3d(1, 2, 0.5)),
      larger(superellipse(0.4), superellipse(1.5), V3d(2, 4, 1));
  for (const V3d& p : {V3d(0.8, 1.5, 0.2), V3d(0.3, 1.9, 0.4), V3d(1.1, 0.4, 0.1)}) {
    const double distance = surface.distance(p, 1);
    EXPECT_NEAR(surface.distance(V3d(-p.x, p.y, -p.z), 1), distance, 1e-9);
    EXPECT_NEAR(larger.distance(p * 2.0, 2), 2 * distance, 1e-9);
  }
}

TEST(Superquadric, HasTheSameBitsOnAnyNumberOfThreads) {
  const auto hash = [] {
    return makeSuperquadric(V3d(2, 1.5, 1), 0.3, 2.5, V3d(0), 0.05).contentHash();
  };
  EXPECT_EQ(support::onThreads(1, hash), support::onThreads(7, hash));
}

TEST(Superquadric, RefusesExponentsOutOfRange) {
  using levelset::UsageError;
  const auto says = [](double vertical, double horizontal, double voxel = 0.1) {
    return refusal<UsageError>(
        [&] { (void)makeSuperquadric(V3d(1), vertical, horizontal, V3d(0), voxel); });
  };
  EXPECT_SAYS(says(0.09, 1), "vertical exponent is 0.09; give a number from 0.1 to 4");
  EXPECT_SAYS(says(1, 4.1), "horizontal");
  EXPECT_SAYS(says(1, NAN), "horizontal");
  EXPECT_SAYS(says(1, 1, -1), "voxel");
  EXPECT_SAYS(refusal<UsageError>([] { (void)makeSuperquadric(V3d(1, 0, 1), 1, 1, V3d(0), 0.1); }),
              "extent");
  EXPECT_FALSE(refusal<levelset::InvalidInput>([] {
                 (void)makeSuperquadric(V3d(1), 1, 1, V3d(0), 3);
               }).empty());
}

TEST(Supershape, OfSymmetryZeroIsABall) {
  const NarrowBand band = makeSupershape({}, {}, 1, V3d(0), 0.05);
  EXPECT_NEAR(measure(band).volume / (4 * kPi / 3), 1, measured(1e-3));
}

TEST(SlowSuperquadric, OfCurvesHasTheDistancesOfFineSamples) {
  double worst = 0;
  const Superformula curves[] = {{0, V3d(2)},
                                 {5, V3d(2, 3, 3)},
                                 {3, V3d(0.8, 1.7, 1.7)},
                                 {6, V3d(1, 1, 6)},
                                 {2.5, V3d(1.2, 1, 2)}};
  for (const Superformula& around : curves)
    for (const Superformula& upright : {curves[0], curves[1], curves[4]}) {
      const double error = worstError(SphericalProduct(around, upright, V3d(1)), 2, 8);
      EXPECT_LT(error, 1e-8) << around.symmetry << ' ' << upright.symmetry;
      worst = std::max(worst, error);
    }
  RecordProperty("worst", std::to_string(worst));
}

TEST(SlowSuperquadric, OfCurvesHasTheirVolume) {
  // V = (∫ r₁² dθ)(∫ r₂³ cos φ dφ) / 3, by the change of variables.
  const Superformula around{5, V3d(2, 3, 3)}, upright{2, V3d(1.5, 2, 2)};
  double first = 0, second = 0;
  constexpr int kSteps = 200'000;
  for (int n = 0; n < kSteps; ++n) {
    const double theta = 2 * kPi * (n + 0.5) / kSteps - kPi,
                 phi = kPi * (n + 0.5) / kSteps - kPi / 2;
    first += around.radius(theta) * around.radius(theta) * 2 * kPi / kSteps;
    second += std::pow(upright.radius(phi), 3) * std::cos(phi) * kPi / kSteps;
  }
  const double volume = first * second / 3;
  double last = 0;
  for (const double voxel : {0.16, 0.08, 0.04}) {
    const double error = std::abs(
        measure(bandToMesh(makeSupershape(around, upright, 1, V3d(0), voxel))).volume / volume - 1);
    EXPECT_LT(error, measured(1.5 * voxel * voxel)) << voxel;
    if (last > 0) {
      EXPECT_GT(std::log2(last / error), 1.6) << voxel;
    }
    last = error;
  }
}

TEST(Supershape, RefusesCurvesOutOfRange) {
  using levelset::UsageError;
  const auto says = [](const Superformula& around) {
    return refusal<UsageError>([&] { (void)makeSupershape(around, {}, 1, V3d(0), 0.1); });
  };
  EXPECT_SAYS(says({-1, V3d(2)}), "symmetry");
  EXPECT_SAYS(says({4, V3d(0, 2, 2)}), "n1");
  EXPECT_SAYS(says({4, V3d(2, 2, 101)}), "n3");
  EXPECT_SAYS(refusal<levelset::InvalidInput>([] {
                (void)makeSupershape({7, V3d(0.1, 8, 8)}, {}, 1, V3d(0), 0.1);
              }),
              "50");
}

}  // namespace superquadric_test
