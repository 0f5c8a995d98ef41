#include "levelset/narrow_band.h"

#include <gtest/gtest.h>

#include <limits>

#include "levelset/error.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

namespace narrow_band_test {

using namespace levelset;

NarrowBand unitSphere(double voxelSize) {
  return support::sampleBand([](const Imath::V3d& p) { return p.length() - 1; },
                             {Imath::V3d(-1), Imath::V3d(1)}, voxelSize);
}

TEST(NarrowBand, CopiesShareStorageUntilOneIsEdited) {
  const NarrowBand original = unitSphere(0.1);
  NarrowBand copy = original;
  EXPECT_EQ(&vdb(original), &vdb(copy));
  editVdb(copy).tree().setValue(openvdb::Coord(0), 1.0f);
  EXPECT_NE(&vdb(original), &vdb(copy));
  EXPECT_NE(original.contentHash(), copy.contentHash());
  EXPECT_EQ(original.contentHash(), unitSphere(0.1).contentHash());
}

TEST(NarrowBand, ReportsItsProperties) {
  const NarrowBand band = unitSphere(0.1);
  EXPECT_DOUBLE_EQ(band.voxelSize(), 0.1);
  EXPECT_NEAR(band.halfWidth(), 3, support::rounding(3));
  const Imath::Box3d box = band.zeroSetBounds();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(box.min[axis], -1, support::rounding(1) * 0.1);
    EXPECT_NEAR(box.max[axis], 1, support::rounding(1) * 0.1);
  }
  EXPECT_TRUE(NarrowBand().isEmpty());
}

TEST(NarrowBand, RefusesGridsThatAreNoLevelSets) {
  const auto sound = [] {
    NarrowBand band = unitSphere(0.2);
    return editVdb(band).deepCopy();
  };
  EXPECT_NO_THROW((void)importBand(sound()));
  auto fog = sound();
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  EXPECT_THROW((void)importBand(fog), InvalidInput);
  auto nan = sound();
  nan->tree().setValueOn(openvdb::Coord(5, 0, 0), std::numeric_limits<float>::quiet_NaN());
  EXPECT_THROW((void)importBand(nan), InvalidInput);
  auto sheared = sound();
  sheared->setTransform(openvdb::math::Transform::createLinearTransform(
      openvdb::math::Mat4d(1., 0., 0., 0., .5, 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.)));
  EXPECT_THROW((void)importBand(sheared), InvalidInput);
  auto mirrored = sound();
  mirrored->setTransform(openvdb::math::Transform::createLinearTransform(
      openvdb::math::Mat4d(-1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.)));
  EXPECT_THROW((void)importBand(mirrored), InvalidInput);
  EXPECT_THROW((void)importBand(nullptr), InvalidInput);
}

}  // namespace narrow_band_test
