#include "tests/support/bisector_prisms.h"

#include <gtest/gtest.h>

#include <random>

#include "levelset/mesh_sign/triangle_distance.h"
#include "tests/support/measured.h"
#include "tests/support/sigg_meshes.h"

namespace bisector_prisms_test {

using Imath::V3d;
using levelset::convert::LocalMesh;
using levelset::convert::TriangleFrame;
using support::BisectorPrisms;
using support::VertexPlanes;

V3d randomDirection(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return V3d(normal(random), normal(random), normal(random)).normalized();
}

TEST(BisectorPrisms, HaveGapsOnlyAtSaddles) {
  std::mt19937 random(1);
  std::size_t saddles = 0, gaps = 0, missed = 0, consecutive = 0, others = 0;
  for (unsigned n = 0; n < 4000; ++n) {
    std::vector<V3d> ring = support::randomFan(random, 4 + n % 5);
    if (n % 4 == 0)  // a convex or a concave vertex
      for (V3d& p : ring) p.z = (n % 8 ? 0.7 : -0.7) * std::hypot(p.x, p.y);
    const VertexPlanes planes(ring);
    saddles += planes.isSaddle;
    const V3d gap = planes.gap();
    if (!planes.isSaddle) {
      ++others;
      EXPECT_EQ(gap, V3d(0)) << n;
    }
    if (gap != V3d(0)) {
      ++gaps;
      EXPECT_EQ(planes.prismsAt(gap), 0u) << n;
      EXPECT_EQ(planes.prismsAt(-gap), 0u) << n;
    }
    consecutive += planes.gap(true) != V3d(0);
    for (int k = 0; k < 50; ++k) {
      const V3d direction = randomDirection(random);
      missed += planes.prismsAt(direction) == 0 && gap == V3d(0);
      // As many prisms contain a point as contain its mirror image at the vertex.
      EXPECT_EQ(planes.prismsAt(direction), planes.prismsAt(-direction));
    }
  }
  EXPECT_EQ(missed, 0u);
  EXPECT_GT(saddles, 2500u);
  EXPECT_GT(others, 1000u);
  EXPECT_GT(gaps, 500u);
  // Consecutive planes alone miss some gaps.
  EXPECT_LT(consecutive, gaps);
}

TEST(BisectorPrisms, HaveGapsAtSaddlesOnly) {
  const auto on = [](const support::TriMesh& mesh) {
    const LocalMesh local{mesh.positions, mesh.triangles};
    return BisectorPrisms(local, 0.1, BisectorPrisms::Gaps::Keep);
  };
  const BisectorPrisms sphere = on(support::subdividedSphere(4)),
                       torus = on(support::torusMesh(1, 0.4, 75, 40)),
                       knot = on(support::trefoilTube(0.4, 120, 12));
  EXPECT_EQ(sphere.saddles() + sphere.gaps(), 0u);
  EXPECT_EQ(torus.gaps(), 0u);
  EXPECT_GT(torus.saddles(), torus.vertices() / 2);
  EXPECT_EQ(knot.vertices(), 1440u);
  EXPECT_EQ(knot.saddles(), 1203u);
  EXPECT_EQ(knot.gaps(), 315u);
}

TEST(BisectorPrisms, CoverTheBandOnceRepaired) {
  const support::TriMesh mesh = support::trefoilTube(0.4, 48, 8);
  const LocalMesh local{mesh.positions, mesh.triangles};
  const double reach = 0.8;
  const BisectorPrisms kept(local, reach, BisectorPrisms::Gaps::Keep),
      repaired(local, reach, BisectorPrisms::Gaps::Repair);
  ASSERT_GT(kept.gaps(), 10u);
  std::mt19937 random(2);
  std::uniform_int_distribution<std::uint32_t> any(0, 767);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t inGaps = 0, uncovered = 0, wrong = 0;
  for (int n = 0; n < 20000; ++n) {
    const V3d p = local.corner(any(random), 0) + randomDirection(random) * reach * unit(random);
    double nearest = 1, inPrisms = 1;
    bool isKept = false, isRepaired = false;
    for (std::uint32_t t = 0; t < local.triangles.size(); ++t) {
      const double squared =
          TriangleFrame(local.corner(t, 0), local.corner(t, 1), local.corner(t, 2))
              .squaredDistance(p);
      nearest = std::min(nearest, squared);
      isKept = isKept || kept.contains(t, p);
      if (!repaired.contains(t, p)) continue;
      isRepaired = true;
      inPrisms = std::min(inPrisms, squared);
    }
    inGaps += !isKept;
    uncovered += !isRepaired;
    wrong += std::sqrt(inPrisms) > std::sqrt(nearest) + 1e-6;
  }
  EXPECT_GT(inGaps, 0u);
  EXPECT_EQ(uncovered, 0u);
  // A covering is not enough: some points lie in no prism of their closest triangle.
  EXPECT_GT(wrong, 0u);
}

}  // namespace bisector_prisms_test
