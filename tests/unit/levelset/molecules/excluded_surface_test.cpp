#include "levelset/molecules/excluded_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/measured.h"

namespace excluded_surface_test {

using Imath::V2d;
using Imath::V3d;
using levelset::Ball;
using levelset::BallUnion;
using levelset::ExcludedSurface;
using support::measured;

constexpr double kProbe = 1.4;

ExcludedSurface surfaceOf(std::vector<Ball> atoms) {
  for (Ball& ball : atoms) ball.radius += kProbe;
  return {BallUnion(std::move(atoms), 5), kProbe};
}

/// Distance from the excluded surface of two atoms with one radius at ±half on the x axis, whose
/// profile consists of arcs of circles.
double twoAtoms(double half, double radius, const V3d& p) {
  const V2d at(std::abs(p.x), std::hypot(p.y, p.z));
  const double ring = std::sqrt((radius + kProbe) * (radius + kProbe) - half * half);
  const V2d atom(half, 0), probe(0, ring);
  // Beyond the line from the atom to the probe lies the sphere of the atom.
  const V2d along = (probe - atom).normalized();
  const double side = (at - atom).x * along.y - (at - atom).y * along.x;
  const double toAtom = (at - atom).length() - radius, toProbe = (at - probe).length();
  if (side >= 0) return toAtom;
  if (ring >= kProbe) return kProbe - toProbe;
  const V2d cusp(std::sqrt(kProbe * kProbe - ring * ring), 0);
  // The torus ends where it meets the axis. Points beside that end are closest to it.
  const V2d end = (cusp - probe).normalized(), from = at - probe;
  const bool isBeforeEnd = from.x * end.y - from.y * end.x <= 0;
  if (isBeforeEnd) return kProbe - toProbe;
  return (at - cusp).length();
}

TEST(ExcludedSurface, OfTwoAtomsIsExact) {
  for (const double half : {0.8, 1.9, 2.5, 2.8, 3.0}) {
    const double radius = 1.7;
    const ExcludedSurface surface =
        surfaceOf({{V3d(-half, 0, 0), radius}, {V3d(half, 0, 0), radius}});
    std::mt19937 random(2);
    std::uniform_real_distribution<double> place(-5, 5);
    double worst = 0;
    int cusps = 0;
    for (int n = 0; n < 4000; ++n) {
      const V3d p = V3d(place(random), place(random), place(random)) * (n % 2 ? 1 : 0.2);
      const double truth = twoAtoms(half, radius, p);
      worst = std::max(worst, std::abs(surface.distance(p) - std::max(truth, kProbe - 5)));
      const double outside = -surface.accessible().distance(p);
      cusps += outside > 0 && outside < kProbe && truth > kProbe - outside + 1e-6;
    }
    EXPECT_LT(worst, 2e-9) << half;
    EXPECT_EQ(cusps > 20, half >= 2.8) << half;
  }
}

TEST(ExcludedSurface, OfOneAtomIsItsBall) {
  const ExcludedSurface surface = surfaceOf({{V3d(1, 2, 3), 1.7}});
  for (const double r : {0.0, 0.5, 1.7, 2.0, 3.1, 3.1 + 1e-12, 7.0})
    EXPECT_NEAR(surface.distance(V3d(1, 2, 3) + V3d(2, -1, 2) / 3 * r), r - 1.7, 1e-13);
}

/// Points of the solid: its surface where one probe touches it, and its inside.
std::vector<V3d> pointsOf(const ExcludedSurface& surface, unsigned seed, int count) {
  std::mt19937 random(seed);
  const BallUnion& larger = surface.accessible();
  const Imath::Box3d box = larger.bounds();
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<V3d> points;
  for (int n = 0; n < count; ++n) {
    const V3d p = box.min + box.size() * V3d(share(random), share(random), share(random));
    const BallUnion::Foot foot = larger.closest(p);
    if (!(foot.distance < 0) || !foot.isExact) continue;
    const V3d end = foot.point + (p - foot.point) * (kProbe / -foot.distance);
    if (-larger.distance(end) >= kProbe * (1 - 1e-10)) points.push_back(end);
  }
  return points;
}

TEST(ExcludedSurface, HasNoPointOfTheSolidNearer) {
  int edges = 0;
  for (const unsigned seed : {1U, 2U, 3U}) {
    // Few atoms far apart, so that the surface has many edges.
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-5.5, 5.5), radius(1.2, 1.9);
    std::vector<Ball> atoms;
    for (int n = 0; n < 16; ++n)
      atoms.push_back({V3d(place(random), place(random), place(random)), radius(random)});
    const ExcludedSurface surface = surfaceOf(atoms);
    const std::vector<V3d> points = pointsOf(surface, seed, 200'000);
    double above = 0, below = 0;
    int tested = 0;
    for (int n = 0; n < 100'000 && tested < 400; ++n) {
      const V3d p(place(random), place(random), place(random));
      const double depth = -surface.accessible().distance(p);
      if (!(depth > 0 && depth < kProbe)) continue;
      const double distance = surface.distance(p);
      const bool isAtEdge = distance > kProbe - depth + 1e-7;
      // One in ten of the others suffices.
      if (!isAtEdge && ++tested % 10) continue;
      edges += isAtEdge;
      tested += isAtEdge;
      double nearest = std::numeric_limits<double>::infinity();
      for (const V3d& point : points) nearest = std::min(nearest, (point - p).length2());
      nearest = std::sqrt(nearest);
      above = std::max(above, distance - nearest);
      below = std::max(below, nearest - distance);
    }
    EXPECT_LT(above, 1e-9);
    EXPECT_LT(below, measured(0.1));  // points are that far apart
  }
  EXPECT_GT(edges, 10);
}

TEST(ExcludedSurface, HasSlopesOfOne) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> place(-6, 6);
  std::vector<Ball> atoms;
  for (int n = 0; n < 20; ++n)
    atoms.push_back({V3d(place(random), place(random), place(random)), 1.6});
  const ExcludedSurface surface = surfaceOf(atoms);
  const double step = 1e-4;
  int steep = 0, flat = 0;
  double most = 0;
  for (int n = 0; n < 3000; ++n) {
    const V3d p(place(random), place(random), place(random));
    if (surface.distance(p) < -3) continue;
    V3d slope;
    for (int c = 0; c < 3; ++c) {
      V3d a = p, b = p;
      a[c] -= step;
      b[c] += step;
      slope[c] = (surface.distance(b) - surface.distance(a)) / (2 * step);
    }
    most = std::max(most, slope.length());
    steep += std::abs(slope.length() - 1) < 1e-5;
    flat += std::abs(slope.length() - 1) >= 1e-5;
  }
  EXPECT_LT(most, 1 + 1e-6);
  EXPECT_GT(steep, 100 * flat);  // differences across the medial axis are smaller
}

}  // namespace excluded_surface_test
