#include "levelset/transform/transform.h"

#include <gtest/gtest.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace transform_test {

using namespace levelset;
using Imath::M44d;
using Imath::V3d;

TEST(Transform, TranslatesRotatesAndScalesExactly) {
  const NarrowBand ball = makeSphere(1, V3d(1, 0, 0), 0.1);
  const M44d matrix = M44d().setScale(2.5) * M44d().setEulerAngles(V3d(0, 0, M_PI / 2)) *
                      M44d().setTranslation(V3d(10, 20, 30));
  const NarrowBand moved = transform(ball, matrix);
  EXPECT_NEAR(moved.voxelSize(), 0.25, support::doubleRounding(4));
  EXPECT_NEAR(moved.halfWidth(), 3, support::rounding(3));
  EXPECT_EQ(moved.activeVoxelCount(), ball.activeVoxelCount());
  support::forEachActive(moved, [&](const V3d& p, double phi) {
    ASSERT_NEAR(phi, (p - V3d(10, 22.5, 30)).length() - 2.5, support::rounding(0.8));
  });
  EXPECT_LT(vdb(moved).tree().getValue(openvdb::Coord(10, 0, 0)), 0);
  // The operand is unchanged, and a rotation keeps every distance.
  EXPECT_EQ(ball.contentHash(), makeSphere(1, V3d(1, 0, 0), 0.1).contentHash());
  const NarrowBand turned = transform(ball, M44d().setEulerAngles(V3d(0.1, 0.2, 0.3)));
  EXPECT_EQ(vdb(turned).tree().getValue({20, 0, 1}), vdb(ball).tree().getValue({20, 0, 1}));
  EXPECT_EQ(transform(ball, M44d()).contentHash(), ball.contentHash());
}

TEST(Transform, RefusesTransformsThatAGridCannotHold) {
  const NarrowBand ball = makeSphere(1, V3d(0), 0.1);
  M44d shear;
  shear[1][0] = 0.3;
  EXPECT_THROW((void)transform(ball, shear), InvalidInput);
  EXPECT_THROW((void)transform(ball, M44d().setScale(V3d(1, 1, -1))), InvalidInput);
  EXPECT_THROW((void)transform(ball, M44d().setScale(V3d(1, 1, 2))), InvalidInput);
  EXPECT_THROW((void)transform(ball, M44d().setScale(V3d(1, 1, 0))), UsageError);
  EXPECT_THROW((void)transform(ball, M44d().setScale(std::nan(""))), UsageError);
  M44d projective;
  projective[0][3] = 0.1;
  EXPECT_THROW((void)transform(ball, projective), UsageError);
  EXPECT_THROW((void)transform(NarrowBand(), M44d()), InvalidInput);
  EXPECT_THROW((void)bake(ball, M44d().setScale(V3d(1, 1, 0)), 0.1), UsageError);
  EXPECT_THROW((void)bake(ball, M44d(), 0), UsageError);
  EXPECT_THROW((void)bake(ball, M44d().setScale(0.01), 0.3), InvalidInput);
}

TEST(Transform, RefusesPositionsBeyondTheirPrecision) {
  const NarrowBand ball = makeSphere(1, V3d(0), 0.1);
  // A hundred million voxels from the origin positions are still precise.
  const NarrowBand far = transform(ball, M44d().setTranslation(V3d(1e7, 0, 0)));
  EXPECT_NEAR(measure(far).volume, measure(ball).volume, support::rounding(0.6));
  for (const double shift : {1e10, 1e12, 1e15, 1e16, 1e300})
    EXPECT_THROW((void)transform(ball, M44d().setTranslation(V3d(shift, 0, 0))), InvalidInput)
        << shift;
  for (const double scale : {1e40, 1e200, 1e-40, 1e-200})
    EXPECT_THROW((void)transform(ball, M44d().setScale(scale)), InvalidInput) << scale;
  TriMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_THROW((void)transform(mesh, M44d().setScale(1e200)), InvalidInput);
  EXPECT_THROW((void)transform(mesh, M44d().setTranslation(V3d(1e200, 0, 0))), InvalidInput);
}

TEST(Transform, BakedEllipsoidIsADistance) {
  const double h = 0.05;
  const NarrowBand baked = bake(makeSphere(1, V3d(0), h), M44d().setScale(V3d(2, 1, 0.7)), h);
  EXPECT_NEAR(measure(baked).volume, 4 * M_PI / 3 * 1.4, support::measured(9.29e-6));
  const auto accessor = vdb(baked).getConstAccessor();
  support::forEachActive(baked, [&](const V3d& p, double phi) {
    // On the axes the distance to the nearer end is known.
    if (p.x == 0 && p.y == 0 && phi > -0.1) {
      EXPECT_NEAR(phi, std::abs(p.z) - 0.7, support::rounding(0.4) * h);
    }
    if (p.y == 0 && p.z == 0 && phi > 0) {
      EXPECT_NEAR(phi, std::abs(p.x) - 2, support::rounding(2) * h);
    }
  });
  EXPECT_LT(accessor.getValue({38, 0, 0}), 0);
}

TEST(Transform, BakedMirrorIsTheMirroredSolid) {
  const double h = 0.0625;
  const NarrowBand rod = makeCapsule(V3d(0), V3d(1, 0.5, 0.25), 0.4, h);
  const NarrowBand mirrored = bake(rod, M44d().setScale(V3d(-1, 1, 1)), h);
  const NarrowBand direct = makeCapsule(V3d(0), V3d(-1, 0.5, 0.25), 0.4, h);
  support::forEachActive(direct, [&](const V3d& p, double phi) {
    const auto c = openvdb::Coord::round(vdb(direct).worldToIndex(toVdb(p)));
    ASSERT_NEAR(vdb(mirrored).tree().getValue(c), phi, support::measured(0.00525) * h) << p;
  });
}

TEST(Transform, MirroredMeshStillFacesOutwards) {
  TriMesh tetrahedron;
  tetrahedron.positions = {V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
  tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  ASSERT_NEAR(signedVolume(tetrahedron), 1.0 / 6, support::doubleRounding(4));
  const TriMesh mirrored = transform(tetrahedron, M44d().setScale(V3d(-2, 1, 1)));
  EXPECT_NEAR(signedVolume(mirrored), 2.0 / 6, support::doubleRounding(4));
  EXPECT_EQ(mirrored.positions[1], V3d(-2, 0, 0));
  const TriMesh moved = transform(tetrahedron, M44d().setTranslation(V3d(1, 2, 3)));
  EXPECT_NEAR(signedVolume(moved), 1.0 / 6, support::doubleRounding(4));
  EXPECT_EQ(moved.triangles, tetrahedron.triangles);
  EXPECT_THROW((void)transform(tetrahedron, M44d().setScale(std::nan(""))), UsageError);
}

}  // namespace transform_test
