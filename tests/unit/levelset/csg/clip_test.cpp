#include "levelset/csg/clip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "levelset/transform/transform.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace clip_test {

using namespace levelset;
using Imath::Box3d;
using Imath::Plane3d;
using Imath::V3d;

TEST(Clip, ClosesHalfASphereAtThePlane) {
  const NarrowBand ball = makeSphere(1, V3d(0), 0.05);
  // A plane through the centre leaves half of the sphere for any direction of its normal.
  for (const V3d& normal : {V3d(0, 0, 1), V3d(1, 2, 3), V3d(-1, 0.2, 0)}) {
    const NarrowBand half = clip(ball, Plane3d(normal, 0));
    EXPECT_NEAR(measure(half).volume, 2 * M_PI / 3, support::measured(0.00589));
    // A grid rounds a right-angled edge over a voxel. The area shrinks by at most the two legs less
    // the chord.
    EXPECT_LT(measure(half).area, 3 * M_PI + 0.01);
    EXPECT_GT(measure(half).area, 3 * M_PI - 2 * M_PI * 0.05 * (2 - std::sqrt(2.0)));
    EXPECT_LT(vdb(half).tree().getValue(openvdb::Coord::round(toVdb(-normal.normalized() * 10))),
              0);
  }
}

TEST(Clip, BoxFacesCloseTheSolid) {
  const NarrowBand ball = makeSphere(2, V3d(0), 0.05, {.halfWidth = 4});
  const Box3d box(V3d(-0.52, -0.61, -0.7), V3d(0.43, 0.58, 0.66));
  const NarrowBand inner = clip(ball, box);
  const NarrowBand direct = makeBox(box.size(), box.center(), 0.05, {.halfWidth = 4});
  ASSERT_EQ(inner.activeVoxelCount(), direct.activeVoxelCount());
  support::forEachActive(direct, [&](const V3d& p, double phi) {
    const auto c = openvdb::Coord::round(vdb(direct).worldToIndex(toVdb(p)));
    ASSERT_NEAR(vdb(inner).tree().getValue(c), phi, support::doubleRounding(1));
  });
}

TEST(Clip, WorksInWorldSpaceOnATurnedGrid) {
  const Imath::M44d turn = Imath::M44d().setEulerAngles(V3d(0.5, 0.6, 0.7));
  const NarrowBand ball = transform(makeSphere(1, V3d(0), 0.05), turn);
  const NarrowBand upper = clip(ball, Box3d(V3d(-2, -2, 0.3), V3d(2, 2, 2)));
  EXPECT_NEAR(measure(upper).volume, M_PI * 0.49 / 3 * 2.3, support::measured(0.00677, 0.01));
  support::forEachActive(upper, [&](const V3d& p, double phi) {
    if (p.z < 0.5 && std::hypot(p.x, p.y) < 0.5) {
      ASSERT_NEAR(phi, 0.3 - p.z, support::measured(7.42e-9));
    }
  });
}

TEST(Clip, RegionsAroundTheSolidHaveNoEffect) {
  const NarrowBand ball = makeSphere(1, V3d(0), 0.1);
  const double far = std::numeric_limits<double>::infinity();
  EXPECT_EQ(clip(ball, Box3d(V3d(-9), V3d(9))).contentHash(), ball.contentHash());
  EXPECT_EQ(clip(ball, Plane3d(V3d(0, 0, 1), 1e6)).contentHash(), ball.contentHash());
  const NarrowBand half = clip(ball, Box3d(V3d(-far, -far, 0.02), V3d(far)));
  EXPECT_EQ(half.zeroSetBounds(), clip(ball, Plane3d(V3d(0, 0, -1), -0.02)).zeroSetBounds());
}

TEST(Clip, RefusesAnEmptyResult) {
  const NarrowBand ball = makeSphere(1, V3d(0), 0.1);
  EXPECT_THROW((void)clip(ball, Box3d(V3d(5), V3d(6))), InvalidInput);
  EXPECT_THROW((void)clip(ball, Box3d(V3d(0.01), V3d(0.02))), InvalidInput);
  EXPECT_THROW((void)clip(ball, Box3d(V3d(0.9), V3d(2))), InvalidInput)
      << "the corner of the box misses the ball";
  EXPECT_THROW((void)clip(ball, Plane3d(V3d(0, 0, 1), -2)), InvalidInput);
  EXPECT_THROW((void)clip(NarrowBand(), Plane3d(V3d(0, 0, 1), 0)), InvalidInput);
}

TEST(Clip, RefusesInvalidRegions) {
  const NarrowBand ball = makeSphere(1, V3d(0), 0.1);
  EXPECT_THROW((void)clip(ball, Box3d(V3d(1), V3d(-1))), UsageError);
  EXPECT_THROW((void)clip(ball, Box3d(V3d(0), V3d(1, 1, 0))), UsageError);
  EXPECT_THROW((void)clip(ball, Box3d(V3d(std::nan("")), V3d(1))), UsageError);
  Plane3d none;
  none.normal = V3d(0);
  none.distance = 0;
  EXPECT_THROW((void)clip(ball, none), UsageError);
  EXPECT_THROW((void)clip(ball, Plane3d(V3d(0, 0, 1), std::nan(""))), UsageError);
}

}  // namespace clip_test
