#include <gtest/gtest.h>
#include <openvdb/tools/Diagnostics.h>

#include <limits>
#include <vector>

#include "levelset/csg/blend.h"
#include "levelset/csg/seam_operands.h"
#include "levelset/error.h"
#include "levelset/geometry/search/point_search.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"
#include "tests/support/threads.h"

namespace fillet_test {

using namespace levelset;
using Imath::V3d;
using Shape = std::function<double(const V3d&)>;

BlendOptions rolled(BlendSide side = BlendSide::Both, std::optional<double> reach = {}) {
  BlendOptions options;
  options.method = BlendMethod::Fillet;
  options.side = side;
  options.reach = reach;
  return options;
}

constexpr double kDepth = 24;  ///< half the length of the edges, along y

/// Half-space within a box: negative on the side opposite to `normal`.
NarrowBand halfSpace(const V3d& normal, const V3d& through, double extent) {
  return support::sampleBand(
      [=](const V3d& p) {
        const V3d q(std::abs(p.x), std::abs(p.y), std::abs(p.z));
        const double wall = std::max({q.x - extent, q.y - kDepth, q.z - extent});
        return std::max(normal.dot(p - through), wall);
      },
      {V3d(-extent, -kDepth, -extent), V3d(extent, kDepth, extent)}, 1);
}

/// Two planes with the outside angle `degrees` between them, which meet along y through kEdge.
const V3d kEdge(0.27, 0.1, -0.38);
struct Wedge {
  V3d n1, n2, middle;  ///< outward normals; direction from the edge into the space between
  V3d along1, along2;  ///< directions from the edge along the planes
  double half = 0;     ///< half of the angle

  explicit Wedge(double degrees) : half(degrees * M_PI / 360) {
    // Rotated off the axes.
    const double tilt = 0.37;
    const auto direction = [](double angle) { return V3d(std::cos(angle), 0, std::sin(angle)); };
    middle = direction(tilt);
    along1 = direction(tilt + half);
    along2 = direction(tilt - half);
    n1 = direction(tilt + half - M_PI / 2);
    n2 = direction(tilt - half + M_PI / 2);
  }
};

struct WedgeError {
  double radius = 0;  ///< largest |distance of the zero set from the axis − r|, voxels
  double beyond = 0;  ///< largest change of φ beyond the arc
  std::size_t count = 0;
};

WedgeError wedgeError(const NarrowBand& filleted, const NarrowBand& plain, const Wedge& wedge,
                      double radius, double extent, double sign) {
  const V3d axis = kEdge + wedge.middle * (radius / std::sin(wedge.half));
  const double tangent = radius / std::tan(wedge.half);
  const BandSampler phi(filleted, Interpolation::Tricubic);
  WedgeError error;
  // Rays from the axis towards the solid, slightly inside both directions in which the ball
  // touches.
  const double reach = M_PI / 2 - wedge.half - 0.03;
  for (double angle = -reach; angle <= reach; angle += 0.02) {
    const V3d across = wedge.middle.cross(V3d(0, 1, 0));
    const V3d ray = wedge.middle * -std::cos(angle) + across * std::sin(angle);
    double low = radius - 2, high = radius + 2;
    const auto at = [&](double t) {
      V3d p = axis + ray * t;
      p.y = 0.4 + angle;
      return sign * phi.value(p);
    };
    if (!(at(low) > 0 && at(high) < 0)) {
      error.radius = 2;
      continue;
    }
    for (int i = 0; i < 40; ++i) (at((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
    error.radius = std::max(error.radius, std::abs(low - radius));
    ++error.count;
  }
  support::forEachActive(plain, [&](const V3d& p, double value) {
    V3d off = p - kEdge;
    off.y = 0;
    const V3d q(std::abs(p.x), std::abs(p.y), std::abs(p.z));
    if (std::max(q.x, q.z) > extent - 6 || q.y > 6) return;
    if (std::max(off.dot(wedge.along1), off.dot(wedge.along2)) < tangent + 0.1) return;
    const auto now =
        static_cast<double>(vdb(filleted).tree().getValue(openvdb::Coord::round(toVdb(p))));
    error.beyond = std::max(error.beyond, std::abs(now - value));
  });
  return error;
}

TEST(Fillet, HasItsRadiusBetweenPlanes) {
  const double radius = 8;
  for (const double degrees : {45.0, 90.0, 135.0}) {
    const double extent = degrees < 60 ? 40 : 28;
    const Wedge wedge(degrees);
    const NarrowBand a = halfSpace(wedge.n1, kEdge, extent), b = halfSpace(wedge.n2, kEdge, extent);
    const CsgResult result = blend(CsgOperation::Union, a, b, radius, rolled());
    EXPECT_TRUE(result.notes.empty());
    const WedgeError error = wedgeError(result.band, unite(a, b), wedge, radius, extent, 1);
    EXPECT_LT(error.radius, support::measured(6.39e-4) * radius) << degrees;
    EXPECT_GT(error.count, 20u);
    EXPECT_LT(error.beyond, support::rounding(1)) << degrees;
    EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(result.band), 6), "") << degrees;
  }
}

TEST(Fillet, RoundsConvexEdgesOfIntersections) {
  const double radius = 8, extent = 28;
  const Wedge wedge(90);
  // The space between the planes is the solid here.
  const NarrowBand a = halfSpace(-wedge.n1, kEdge, extent), b = halfSpace(-wedge.n2, kEdge, extent);
  const NarrowBand plain = intersect(a, b);
  const CsgResult result = blend(CsgOperation::Intersection, a, b, radius, rolled());
  const WedgeError error = wedgeError(result.band, plain, wedge, radius, extent, -1);
  EXPECT_LT(error.radius, support::measured(4.55e-4) * radius);
  EXPECT_LT(error.beyond, support::rounding(1));
}

Shape cylinder(int axis, double radius, double length, const V3d& centre) {
  return [=](const V3d& p) {
    V3d q = p - centre;
    const double along = std::abs(q[axis]) - length;
    q[axis] = 0;
    const double across = q.length() - radius;
    return std::min(std::max(along, across), 0.0) +
           std::hypot(std::max(along, 0.0), std::max(across, 0.0));
  };
}

// From each point of the fillet, the centre of a ball that touches both cylinders lies along the
// normal.
TEST(Fillet, RollsAlongCrossedCylinders) {
  const double radius = 6;
  const V3d centre(0.3, -0.2, 0.1);
  const Shape first = cylinder(0, 14, 44, centre), second = cylinder(1, 14, 44, centre);
  const NarrowBand a = support::sampleBand(first, {V3d(-46), V3d(46)}, 1),
                   b = support::sampleBand(second, {V3d(-46), V3d(46)}, 1);
  const CsgResult result = blend(CsgOperation::Union, a, b, radius, rolled());
  const BandSampler phi(result.band, Interpolation::Tricubic);
  double worst = 0;
  int count = 0;
  support::forEachActive(result.band, [&](const V3d& p, double value) {
    const double plain = std::min(first(p), second(p));
    if (std::abs(value) > 0.5 || plain < 1 || p.length() > 30) return;
    V3d normal = phi.gradient(p);
    normal.normalize();
    const V3d ball = p + normal * (radius - value);
    worst = std::max({worst, std::abs(first(ball) - radius), std::abs(second(ball) - radius)});
    ++count;
  });
  EXPECT_GT(count, 100);
  EXPECT_LT(worst, support::measured(0.00287) * radius);
  EXPECT_EQ(openvdb::tools::checkLevelSet(vdb(result.band), 6), "");
}

double largestChange(const NarrowBand& a, const NarrowBand& b) {
  double worst = 0;
  auto read = vdb(b).getConstAccessor();
  for (auto it = vdb(a).cbeginValueOn(); it; ++it)
    worst = std::max(worst, std::abs(static_cast<double>(*it - read.getValue(it.getCoord()))));
  return worst;
}

TEST(Fillet, LeavesNoVoidWhereTheSpineBendsAroundTheSeam) {
  // On the plane through both seams the distance to the nearest point of the spine shrinks by only
  // a fifth per step. An earlier version gave up at these grid points.
  const V3d turned = V3d(2, 1, 2) / 3.0, across = V3d(1, 2, -2) / 3.0;
  for (const auto& [u, v] : {std::pair{V3d(1, 0, 0), V3d(0, 1, 0)}, std::pair{turned, across}}) {
    const NarrowBand a = makeCapsule(u * -24.0, u * 24.0, 12, 1),
                     b = makeCapsule(v * -24.0, v * 24.0, 12, 1);
    const Measurement m = measure(blend(CsgOperation::Union, a, b, 8, rolled()).band);
    EXPECT_EQ(m.cavities, 0u);
    EXPECT_EQ(m.components, 1u);
  }
}

TEST(Fillet, KnowsTheDepthInsideThickSolids) {
  // In an earlier version a solid was empty far from its surface, beyond the blocks there. The ball
  // then rolled through it along the other solid.
  const NarrowBand thick = makeSphere(40, V3d(0), 1);
  const std::vector<openvdb::Vec3d> points = {{40, 0, 0}, {0, 40, 0}};
  const PointSearch curve = makePointSearch(points);
  const openvdb::FloatGrid::Ptr part = solids::cutOut(vdb(thick), curve, 20);
  for (int depth = 1; depth <= 40; ++depth)
    EXPECT_LT(part->tree().getValue(openvdb::Coord(40 - depth, 0, 0)), 0) << depth;
  EXPECT_GT(part->tree().getValue(openvdb::Coord(50, 0, 0)), 0);
  EXPECT_GT(part->tree().getValue(openvdb::Coord(80, 0, 0)), 0);
}

TEST(Fillet, HasNoBulgeWhereSurfacesNearlyTouch) {
  // Two balls with a small overlap meet at a small angle.
  const auto ball = [](double x) {
    return support::sampleBand([=](const V3d& p) { return (p - V3d(x, 0.2, 0.1)).length() - 24; },
                               {V3d(x - 24, -24, -24), V3d(x + 24, 25, 25)}, 1);
  };
  const NarrowBand a = ball(-23.3), b = ball(23.3), apart = ball(25.1);
  const NarrowBand plain = unite(a, b);
  const double reach = 4;
  const CsgResult result = blend(CsgOperation::Union, a, b, 8, rolled(BlendSide::Both, reach));
  support::forEachActive(result.band, [&](const V3d& p, double value) {
    if (std::abs(value) > 0.5) return;
    const V3d centre(p.x < 0 ? -23.3 : 23.3, 0.2, 0.1);
    // No further from the solids than the extent of the fillet.
    EXPECT_LT((p - centre).length() - 24, reach);
  });
  const CsgResult gap = blend(CsgOperation::Union, a, apart, 8, rolled());
  EXPECT_FALSE(gap.notes.empty());
  EXPECT_EQ(gap.band.contentHash(), unite(a, apart).contentHash());
}

TEST(Fillet, DoesNotExtendBeyondTheSolids) {
  const Wedge wedge(45);
  const NarrowBand a = halfSpace(wedge.n1, kEdge, 24), b = halfSpace(wedge.n2, kEdge, 24);
  const auto hash = [&](double reach) {
    return blend(CsgOperation::Union, a, b, 5, rolled(BlendSide::Both, reach)).band.contentHash();
  };
  // At 45° the middle of the arc is 8 voxels from the seam. A larger radius changes nothing.
  const std::uint64_t expected = hash(9);
  for (const double reach : {1e3, 1e300}) EXPECT_EQ(hash(reach), expected) << reach;
}

TEST(Fillet, ReportsProgress) {
  const Wedge wedge(90);
  const NarrowBand a = halfSpace(wedge.n1, kEdge, 20), b = halfSpace(wedge.n2, kEdge, 20);
  BlendOptions options = rolled();
  int during = 0;
  double last = 0;
  options.progress = [&](double fraction) {
    EXPECT_GE(fraction, last);
    last = fraction;
    during += fraction > 0.41 && fraction < 0.79;
    return true;
  };
  (void)blend(CsgOperation::Union, a, b, 6, options);
  EXPECT_GT(during, 5);
}

TEST(Fillet, StaysOnItsSide) {
  const Wedge wedge(90);
  const NarrowBand a = halfSpace(wedge.n1, kEdge, 24), b = halfSpace(wedge.n2, kEdge, 24);
  const NarrowBand plain = unite(a, b);
  const CsgResult none = blend(CsgOperation::Union, a, b, 5, rolled(BlendSide::Remove));
  EXPECT_FALSE(none.notes.empty());
  EXPECT_EQ(none.band.contentHash(), plain.contentHash());
  const CsgResult added = blend(CsgOperation::Union, a, b, 5, rolled(BlendSide::Add));
  EXPECT_EQ(added.band.contentHash(),
            blend(CsgOperation::Union, a, b, 5, rolled()).band.contentHash());
  EXPECT_GT(largestChange(plain, added.band), 1);
  // In a difference, the remaining part of `a` has a convex edge along the seam.
  const NarrowBand cut = subtract(a, b);
  const CsgResult removed = blend(CsgOperation::Difference, a, b, 5, rolled(BlendSide::Remove));
  support::forEachActive(removed.band, [&](const V3d& p, double value) {
    // Equal up to the accuracy of the distances at the seam.
    const auto before =
        static_cast<double>(vdb(cut).tree().getValue(openvdb::Coord::round(toVdb(p))));
    EXPECT_GE(value, before - 0.05);
  });
}

TEST(Fillet, IsTheSameForAnyNumberOfThreads) {
  const Wedge wedge(90);
  const NarrowBand a = halfSpace(wedge.n1, kEdge, 20), b = halfSpace(wedge.n2, kEdge, 20);
  std::uint64_t hash[2] = {};
  for (int i = 0; i < 2; ++i)
    hash[i] = support::onThreads(i ? 4 : 1, [&] {
      return blend(CsgOperation::Union, a, b, 4, rolled()).band.contentHash();
    });
  EXPECT_EQ(hash[0], hash[1]);
}

TEST(Fillet, Refuses) {
  const Wedge wedge(90);
  const NarrowBand a = halfSpace(wedge.n1, kEdge, 12), b = halfSpace(wedge.n2, kEdge, 12);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double reach : {nan, -1.0, 0.0})
    EXPECT_THROW((void)blend(CsgOperation::Union, a, b, 3, rolled(BlendSide::Both, reach)),
                 UsageError);
  EXPECT_THROW((void)blend(CsgOperation::Union, a, b, nan, rolled()), UsageError);
  EXPECT_THROW((void)blend(CsgOperation::Union, a, b, 1e4, rolled()), InvalidInput);
  BlendOptions flow;
  flow.reach = 3;
  EXPECT_THROW((void)blend(CsgOperation::Union, a, b, 3, flow), UsageError);
}

}  // namespace fillet_test
