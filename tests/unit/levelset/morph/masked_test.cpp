#include "levelset/morph/masked.h"

#include <gtest/gtest.h>

#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/offset/offset.h"
#include "levelset/shapes/shapes.h"

namespace masked_test {

using Imath::V3d;
using levelset::NarrowBand;

constexpr double kVoxel = 0.05;

levelset::Mask rightHalf() {
  return {.field = [](const V3d& p) { return p.x; }, .min = -0.1, .max = 0.1};
}

NarrowBand grownWhere(const levelset::Mask& mask, const levelset::MaskedOptions& options = {}) {
  const NarrowBand ball = levelset::makeSphere(1, V3d(0), kVoxel);
  return levelset::masked(
      ball, mask, 0.2,
      [&](const levelset::Progress& progress) {
        return levelset::offset(ball, 0.2, {.progress = progress});
      },
      options);
}

TEST(Masked, ChangesTheSurfaceWhereTheMaskAllowsIt) {
  const NarrowBand result = grownWhere(rightHalf());
  const levelset::BandSampler phi(result, levelset::Interpolation::Tricubic);
  EXPECT_NEAR(phi.value(V3d(1.2, 0, 0)), 0, 0.01 * kVoxel);
  EXPECT_NEAR(phi.value(V3d(-1, 0, 0)), 0, 0.01 * kVoxel);
}

TEST(Masked, InvertsTheMask) {
  levelset::Mask left = rightHalf();
  left.invert = true;
  const NarrowBand result = grownWhere(left);
  const levelset::BandSampler phi(result, levelset::Interpolation::Tricubic);
  EXPECT_NEAR(phi.value(V3d(1, 0, 0)), 0, 0.01 * kVoxel);
  EXPECT_NEAR(phi.value(V3d(-1.2, 0, 0)), 0, 0.01 * kVoxel);
}

TEST(Masked, TakesAHalfWidthAndRefusesABadMask) {
  EXPECT_EQ(grownWhere(rightHalf(), {.halfWidth = 5}).halfWidth(), 5);
  levelset::Mask bad = rightHalf();
  bad.max = -1;
  EXPECT_THROW((void)grownWhere(bad), levelset::UsageError);
}

}  // namespace masked_test
