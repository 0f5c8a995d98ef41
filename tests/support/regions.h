#pragma once

// Regions of interest in tests: random arguments, and the comparison of a part with the whole.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "levelset/narrow_band.h"
#include "levelset/region_of_interest.h"
#include "levelset/transform/crop.h"
#include "levelset/vdb.h"

namespace support {

inline double between(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline Imath::V3d pointIn(std::mt19937& random, double r) {
  return {between(random, -r, r), between(random, -r, r), between(random, -r, r)};
}
inline std::string text(const Imath::V3d& p) {
  return std::to_string(p.x) + "," + std::to_string(p.y) + "," + std::to_string(p.z);
}

/// Expects that the region of interest of two bands is equal, voxel by voxel.
/// @param tolerance  voxels
/// @return number of compared voxels
inline std::size_t expectSamePart(const levelset::NarrowBand& whole,
                                  const levelset::NarrowBand& made,
                                  const levelset::RegionOfInterest& part, double tolerance,
                                  const std::string& what) {
  const levelset::NarrowBand wanted = levelset::cropped(whole, {.halfWidth = part.halfWidth});
  EXPECT_EQ(levelset::vdb(wanted).background(), levelset::vdb(made).background()) << what;
  const openvdb::CoordBBox box = levelset::vdb(whole).evalActiveVoxelBoundingBox();
  auto a = levelset::vdb(wanted).getConstAccessor(), b = levelset::vdb(made).getConstAccessor();
  std::size_t compared = 0, different = 0;
  double largest = 0;
  for (auto c = box.begin(); c; ++c) {
    const openvdb::Vec3d place = levelset::vdb(whole).indexToWorld(*c);
    if (!part.region.intersects(Imath::V3d(place.x(), place.y(), place.z()))) continue;
    ++compared;
    float u = 0, v = 0;
    const bool uOn = a.probeValue(*c, u), vOn = b.probeValue(*c, v);
    const double apart = static_cast<double>(std::abs(u - v)) / whole.voxelSize();
    // Rounding may move a value across the end of the band.
    if (apart <= tolerance && (uOn == vOn || tolerance > 0)) continue;
    ++different;
    largest = std::max(largest, apart);
  }
  EXPECT_EQ(different, 0u) << what << ": of " << compared << ", by up to " << largest << " voxels";
  return compared;
}

}  // namespace support
