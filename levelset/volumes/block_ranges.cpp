#include "levelset/volumes/block_ranges.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <span>

#include "levelset/splines/grid_extension.h"

namespace levelset {
namespace {

using Imath::V3i;
using Range = BlockRanges::Range;

constexpr int kBlock = BlockRanges::kBlock, kReach = BlockRanges::kReach;
constexpr Range kNone{std::numeric_limits<float>::infinity(),
                      -std::numeric_limits<float>::infinity()};

void widen(Range& range, const Range& by) {
  range.low = std::min(range.low, by.low);
  range.high = std::max(range.high, by.high);
}

int blocksOfAxis(int points) {
  return (points - 1 + kBlock - 1) / kBlock;
}

/// Calls visit(block, isNarrow) for the blocks along an axis whose wide range contains the grid
/// point n; isNarrow is true when the narrow range contains it, too.
template <typename Visit>
void overBlocks(int n, int points, int blocks, const Visit& visit) {
  const int last = points - 1;
  const int first = std::max(0, (n - kBlock - kReach + kBlock - 1) / kBlock);
  for (int b = first; b < blocks; ++b) {
    const int low = b * kBlock, high = std::min(low + kBlock, last);
    if (low - kReach > n) break;
    if (high + kReach < n) continue;
    visit(b, low <= n && n <= high);
  }
}

/// The stored numbers of a row along x, extended by kReach on both sides.
class RowReader {
 public:
  explicit RowReader(const Volume& volume)
      : volume_(volume),
        row_(static_cast<std::size_t>(volume.size().x)),
        sum_(row_.size()),
        extended_(row_.size() + 2 * kReach) {}

  /// @return item n: stored number of the grid point n − kReach
  const std::vector<float>& read(int j, int k) {
    const V3i size = volume_.size();
    const bool isInside = j >= 0 && j < size.y && k >= 0 && k < size.z;
    if (isInside) {
      volume_.storedRow(j, k, row_);
    } else {
      const ExtensionWeights y = extensionWeights(j, size.y, GridExtension::Quadratic),
                             z = extensionWeights(k, size.z, GridExtension::Quadratic);
      std::fill(sum_.begin(), sum_.end(), 0.0);
      for (std::size_t c = 0; c < static_cast<std::size_t>(z.count); ++c)
        for (std::size_t b = 0; b < static_cast<std::size_t>(y.count); ++b) {
          volume_.storedRow(y.index[b], z.index[c], row_);
          const auto weight = static_cast<double>(y.weight[b] * z.weight[c]);
          for (std::size_t i = 0; i < row_.size(); ++i)
            sum_[i] += weight * static_cast<double>(row_[i]);
        }
      std::transform(sum_.begin(), sum_.end(), row_.begin(),
                     [](double v) { return static_cast<float>(v); });
    }
    std::copy(row_.begin(), row_.end(), extended_.begin() + kReach);
    for (int d = 1; d <= kReach; ++d)
      for (const int n : {-d, size.x - 1 + d}) {
        const ExtensionWeights x = extensionWeights(n, size.x, GridExtension::Quadratic);
        double sum = 0;
        for (std::size_t a = 0; a < static_cast<std::size_t>(x.count); ++a)
          sum += static_cast<double>(x.weight[a]) *
                 static_cast<double>(row_[static_cast<std::size_t>(x.index[a])]);
        extended_[static_cast<std::size_t>(n + kReach)] = static_cast<float>(sum);
      }
    return extended_;
  }

 private:
  const Volume& volume_;
  std::vector<float> row_;
  std::vector<double> sum_;
  std::vector<float> extended_;
};

/// Range of the numbers `from` … `to` of a row.
Range rangeOf(const std::vector<float>& row, int from, int to) {
  // Four ranges at once, so that the comparisons do not wait for each other.
  std::array<Range, 4> part{kNone, kNone, kNone, kNone};
  for (int n = from; n <= to; ++n) {
    const float v = row[static_cast<std::size_t>(n)];
    widen(part[static_cast<std::size_t>(n & 3)], {v, v});
  }
  for (std::size_t i = 1; i < 4; ++i) widen(part[0], part[i]);
  return part[0];
}

struct Slice {
  std::vector<Range> narrow, wide;  // ordered by x, y of the block
};

/// Ranges of the grid points of one slice across z.
Slice sliceOf(RowReader& rows, const V3i& points, const V3i& size, int k) {
  const auto count = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
  Slice slice{std::vector<Range>(count, kNone), std::vector<Range>(count, kNone)};
  std::vector<Range> narrow(static_cast<std::size_t>(size.x)), wide(narrow.size());
  for (int j = -kReach; j < points.y + kReach; ++j) {
    const std::vector<float>& row = rows.read(j, k);
    for (int b = 0; b < size.x; ++b) {
      const int low = b * kBlock, high = std::min(low + kBlock, points.x - 1);
      Range range = narrow[static_cast<std::size_t>(b)] = rangeOf(row, low + kReach, high + kReach);
      widen(range, rangeOf(row, low, low + kReach - 1));
      widen(range, rangeOf(row, high + kReach + 1, high + 2 * kReach));
      wide[static_cast<std::size_t>(b)] = range;
    }
    overBlocks(j, points.y, size.y, [&](int by, bool isNarrow) {
      for (int b = 0; b < size.x; ++b) {
        const auto at = static_cast<std::size_t>(b * size.y + by);
        widen(slice.wide[at], wide[static_cast<std::size_t>(b)]);
        if (isNarrow) widen(slice.narrow[at], narrow[static_cast<std::size_t>(b)]);
      }
    });
  }
  return slice;
}

std::size_t countOf(const V3i& size) {
  return static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y) *
         static_cast<std::size_t>(size.z);
}

/// Ranges of groups of 8³ blocks.
std::vector<Range> grouped(const std::vector<Range>& ranges, const V3i& size, const V3i& groups) {
  std::vector<Range> result(countOf(groups), kNone);
  std::size_t n = 0;
  for (int x = 0; x < size.x; ++x)
    for (int y = 0; y < size.y; ++y)
      for (int z = 0; z < size.z; ++z)
        widen(result[static_cast<std::size_t>(((x >> 3) * groups.y + (y >> 3)) * groups.z +
                                              (z >> 3))],
              ranges[n++]);
  return result;
}

}  // namespace

BlockRanges::BlockRanges(const Volume& volume, const Progress& progress)
    : size_(blocksOfAxis(volume.size().x), blocksOfAxis(volume.size().y),
            blocksOfAxis(volume.size().z)),
      groups_((size_.x + 7) / 8, (size_.y + 7) / 8, (size_.z + 7) / 8),
      scale_(volume.scale()) {
  const V3i points = volume.size();
  narrow_.assign(countOf(size_), kNone);
  wide_.assign(countOf(size_), kNone);
  if (narrow_.empty()) return;
  // Layers of blocks at once, with the slices that they share.
  constexpr int kLayers = 8;
  for (int first = 0; first < size_.z; first += kLayers) {
    const int last = std::min(first + kLayers, size_.z) - 1;
    const int from = first * kBlock - kReach,
              to = std::min((last + 1) * kBlock, points.z - 1) + kReach;
    std::vector<Slice> slices(static_cast<std::size_t>(to - from + 1));
    tbb::parallel_for(tbb::blocked_range<int>(from, to + 1), [&](const auto& range) {
      RowReader rows(volume);
      for (int k = range.begin(); k != range.end(); ++k)
        slices[static_cast<std::size_t>(k - from)] = sliceOf(rows, points, size_, k);
    });
    for (int k = from; k <= to; ++k) {
      const Slice& slice = slices[static_cast<std::size_t>(k - from)];
      overBlocks(k, points.z, size_.z, [&](int bz, bool isNarrow) {
        if (bz < first || bz > last) return;
        for (std::size_t n = 0; n < slice.wide.size(); ++n) {
          const std::size_t at =
              n * static_cast<std::size_t>(size_.z) + static_cast<std::size_t>(bz);
          widen(wide_[at], slice.wide[n]);
          if (isNarrow) widen(narrow_[at], slice.narrow[n]);
        }
      });
    }
    report(progress, static_cast<double>(last + 1) / size_.z);
  }
  narrowGroups_ = grouped(narrow_, size_, groups_);
  wideGroups_ = grouped(wide_, size_, groups_);
}

std::size_t BlockRanges::bytes() const {
  return sizeof(Range) *
         (narrow_.size() + wide_.size() + narrowGroups_.size() + wideGroups_.size());
}

std::vector<Range> BlockRanges::valuesOf(const std::vector<Range>& stored) const {
  std::vector<Range> values;
  values.reserve(stored.size());
  for (const Range& range : stored) {
    double low = scale_(static_cast<double>(range.low)),
           high = scale_(static_cast<double>(range.high));
    if (low > high) std::swap(low, high);
    // Rounded outwards, but exact numbers stay: a transfer function often starts at the value of
    // the background.
    constexpr float kFar = std::numeric_limits<float>::infinity();
    auto below = static_cast<float>(low), above = static_cast<float>(high);
    if (static_cast<double>(below) > low) below = std::nextafter(below, -kFar);
    if (static_cast<double>(above) < high) above = std::nextafter(above, kFar);
    values.push_back({below, above});
  }
  return values;
}

template <typename Takes>
std::vector<V3i> BlockRanges::blocksWith(const std::vector<Range>& ofBlocks,
                                         const std::vector<Range>& ofGroups,
                                         const Takes& takes) const {
  const auto takesStored = [&](const Range& range) {
    const double a = scale_(static_cast<double>(range.low)),
                 b = scale_(static_cast<double>(range.high));
    return takes(std::min(a, b), std::max(a, b));
  };
  std::vector<char> isOpen(ofGroups.size());
  std::transform(ofGroups.begin(), ofGroups.end(), isOpen.begin(), takesStored);
  std::vector<V3i> blocks;
  for (int x = 0; x < size_.x; ++x)
    for (int y = 0; y < size_.y; ++y) {
      const auto group = static_cast<std::size_t>(((x >> 3) * groups_.y + (y >> 3)) * groups_.z);
      const std::size_t row = (static_cast<std::size_t>(x) * static_cast<std::size_t>(size_.y) +
                               static_cast<std::size_t>(y)) *
                              static_cast<std::size_t>(size_.z);
      for (int z = 0; z < size_.z; ++z) {
        if (!isOpen[group + static_cast<std::size_t>(z >> 3)]) {
          z |= 7;
          continue;
        }
        if (takesStored(ofBlocks[row + static_cast<std::size_t>(z)]))
          blocks.emplace_back(x * kBlock, y * kBlock, z * kBlock);
      }
    }
  return blocks;
}

std::vector<V3i> BlockRanges::crossed(double isovalue, bool isOpenAbove) const {
  return blocksWith(narrow_, narrowGroups_, [&](double low, double high) {
    return isOpenAbove ? low < isovalue && high >= isovalue : low <= isovalue && high > isovalue;
  });
}

std::vector<V3i> BlockRanges::crossedWidely(double isovalue, double widening) const {
  // Extended values are rounded to single precision.
  constexpr double kRounding = 1e-6;
  return blocksWith(wide_, wideGroups_, [&](double low, double high) {
    const double room =
        widening * (high - low) + kRounding * std::max({high - low, std::abs(low), std::abs(high)});
    return low - room <= isovalue && isovalue <= high + room;
  });
}

}  // namespace levelset
