#include "levelset/volumes/block_ranges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "levelset/splines/grid_extension.h"

namespace block_ranges_test {

using Imath::V3i;
using levelset::BlockRanges;
using levelset::Volume;

/// Bytes with a few bumps between constant parts, so that many blocks have one value.
Volume bumps(const V3i& size, const levelset::VolumeScale& scale) {
  std::mt19937 random(5);
  const auto bytes = std::make_shared<std::vector<unsigned char>>();
  for (int k = 0; k < size.z; ++k)
    for (int j = 0; j < size.y; ++j)
      for (int i = 0; i < size.x; ++i) {
        const bool isNoise = i / 11 % 2 == 0 && j / 13 % 2 == 0 && k / 9 % 2 == 0;
        bytes->push_back(static_cast<unsigned char>(isNoise ? random() % 200 : 17));
      }
  return {{size, {}},
          levelset::VolumeType::U8,
          scale,
          {bytes, reinterpret_cast<const char*>(bytes->data())}};
}

/// Lowest grid points of the blocks for which `takes` holds for the range of their grid points,
/// extended by `reach`.
template <typename Takes>
std::vector<V3i> searched(const Volume& volume, int reach, const Takes& takes) {
  const V3i size = volume.size();
  const levelset::ExtendedGrid grid([&](int i, int j, int k) { return volume.at(i, j, k); },
                                    {size.x, size.y, size.z}, levelset::GridExtension::Quadratic);
  std::vector<V3i> found;
  for (int x = 0; x + 1 < size.x; x += 8)
    for (int y = 0; y + 1 < size.y; y += 8)
      for (int z = 0; z + 1 < size.z; z += 8) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (int i = x - reach; i <= std::min(x + 8, size.x - 1) + reach; ++i)
          for (int j = y - reach; j <= std::min(y + 8, size.y - 1) + reach; ++j)
            for (int k = z - reach; k <= std::min(z + 8, size.z - 1) + reach; ++k) {
              const double v = grid(i, j, k);
              low = std::min(low, v);
              high = std::max(high, v);
            }
        if (takes(low, high)) found.emplace_back(x, y, z);
      }
  return found;
}

TEST(BlockRanges, FindTheBlocksThatASearchFinds) {
  for (const levelset::VolumeScale scale : {levelset::VolumeScale{}, {-0.5, 3}})
    for (const V3i& size : {V3i(70, 31, 45), V3i(9, 8, 2), V3i(17, 1, 20)}) {
      const Volume volume = bumps(size, scale);
      const BlockRanges ranges(volume);
      for (const double stored : {17.0, 16.5, 199.0, 0.0, 60.25, 250.0}) {
        const double v = scale(stored);
        EXPECT_EQ(ranges.crossed(v), searched(volume, 0, [&](double low, double high) {
                    return low <= v && v < high;
                  }));
        EXPECT_EQ(ranges.crossed(v, true), searched(volume, 0, [&](double low, double high) {
                    return low < v && v <= high;
                  }));
        for (const double widening : {0.0, 1.0})
          EXPECT_EQ(ranges.crossedWidely(v, widening),
                    searched(volume, 2, [&](double low, double high) {
                      const double room = widening * (high - low) + 1e-6 * (high - low + 20);
                      return low - room <= v && v <= high + room;
                    }));
      }
    }
}

}  // namespace block_ranges_test
