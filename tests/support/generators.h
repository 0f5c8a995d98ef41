#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "levelset/inspect/check.h"
#include "levelset/vdb.h"
#include "tests/support/bands.h"
#include "tests/support/measured.h"

/// Requirements on the texture generators.
namespace support {

/// Expects that grid values at p and at p + shift agree to rounding wherever both are in `box`.
inline void expectPeriodic(const levelset::NarrowBand& band, const Imath::V3d& shift,
                           const Imath::Box3d& box) {
  const double voxel = band.voxelSize();
  openvdb::Coord step, low, high;
  for (int axis = 0; axis < 3; ++axis) {
    step[axis] = static_cast<int>(std::lround(shift[axis] / voxel));
    ASSERT_NEAR(step[axis] * voxel, shift[axis], support::doubleRounding(1.5)) << "whole voxels";
    low[axis] = static_cast<int>(std::ceil(box.min[axis] / voxel));
    high[axis] = static_cast<int>(std::floor(box.max[axis] / voxel));
  }
  const auto values = levelset::vdb(band).getConstAccessor();
  std::size_t compared = 0;
  for (const openvdb::Coord& c : openvdb::CoordBBox(low, high)) {
    ASSERT_NEAR(values.getValue(c), values.getValue(c + step), support::measured(4.62e-6) * voxel)
        << c;
    compared += values.isValueOn(c);
  }
  EXPECT_GT(compared, 500u);
}

/// Checks distances against the solid itself, without regard to how the band was built. No point of
/// the other side may be closer than the value less `slack`. Some point of the other side must lie
/// at most four times `slack` beyond the value. Corners need that much, because only finitely many
/// directions are tried.
/// @param isInside  true for points of the solid
inline void expectNearest(const levelset::NarrowBand& band,
                          const std::function<bool(const Imath::V3d&)>& isInside, double slack,
                          std::size_t stride, bool alsoInside = true) {
  std::size_t count = 0, looked = 0, missed = 0;
  forEachActive(band, [&](const Imath::V3d& p, double phi) {
    const double distance = std::abs(phi);
    if (++count % stride != 0 || distance < 2 * slack || (phi < 0 && !alsoInside)) return;
    ++looked;
    ASSERT_EQ(isInside(p), phi < 0) << p;
    constexpr int kDirections = 1500;
    bool isReached = false;
    for (int k = 0; k < kDirections; ++k) {
      const double z = 1 - (2 * k + 1.0) / kDirections, turn = k * 2.399963229728653;
      const double r = std::sqrt(1 - z * z);
      const Imath::V3d direction(r * std::cos(turn), r * std::sin(turn), z);
      ASSERT_EQ(isInside(p + direction * (distance - slack)), phi < 0) << p << " at " << phi;
      isReached = isReached || isInside(p + direction * (distance + 4 * slack)) != (phi < 0);
    }
    missed += !isReached;
  });
  EXPECT_GT(looked, 40u);
  EXPECT_LT(static_cast<double>(missed), 0.06 * static_cast<double>(looked))
      << "directions may miss a slim corner, but no face";
}

inline void expectSound(const levelset::NarrowBand& band) {
  const levelset::CheckReport report = levelset::check(band);
  for (const levelset::CheckItem& item : report.items)
    EXPECT_TRUE(item.passed) << item.name << ": " << item.detail;
}

}  // namespace support
