#include "levelset/volumes/histogram.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "levelset/error.h"

namespace levelset {
namespace {

/// Counts and sums of a part of the volume.
struct HistogramPart {
  std::vector<std::uint64_t> counts;
  std::vector<double> gradients;
};

/// Inverse transposed matrix of the index axes: turns a gradient by index into one by position.
Imath::M33d gradientMap(const Imath::M44d& m) {
  return Imath::M33d(m[0][0], m[0][1], m[0][2], m[1][0], m[1][1], m[1][2], m[2][0], m[2][1],
                     m[2][2])
      .inverse()
      .transposed();
}

/// Difference quotient along an axis; one-sided at the border.
double slopeAlong(const Volume& volume, Imath::V3i at, int axis) {
  Imath::V3i before = at, after = at;
  if (before[axis] > 0) --before[axis];
  if (after[axis] + 1 < volume.size()[axis]) ++after[axis];
  const int step = after[axis] - before[axis];
  if (step == 0) return 0;
  return (volume.at(after.x, after.y, after.z) - volume.at(before.x, before.y, before.z)) / step;
}

/// Limits between bins that maximise the sum of weight × mean² of the classes, which is the same
/// optimum as the least variance within them. O(classes × bins²).
std::vector<std::size_t> otsuLimits(const std::vector<std::uint64_t>& counts, std::size_t classes) {
  const std::size_t bins = counts.size();
  std::vector<double> weight(bins + 1, 0), moment(bins + 1, 0);
  for (std::size_t n = 0; n < bins; ++n) {
    weight[n + 1] = weight[n] + static_cast<double>(counts[n]);
    moment[n + 1] = moment[n] + static_cast<double>(counts[n]) * static_cast<double>(n);
  }
  const auto gain = [&](std::size_t from, std::size_t to) {
    const double w = weight[to] - weight[from], m = moment[to] - moment[from];
    return w > 0 ? m * m / w : 0;
  };
  std::vector<std::vector<double>> best(classes + 1, std::vector<double>(bins + 1, -1));
  std::vector<std::vector<std::size_t>> cut(classes + 1, std::vector<std::size_t>(bins + 1, 0));
  for (std::size_t to = 1; to <= bins; ++to) best[1][to] = gain(0, to);
  for (std::size_t c = 2; c <= classes; ++c)
    for (std::size_t to = c; to <= bins; ++to)
      for (std::size_t from = c - 1; from < to; ++from) {
        const double sum = best[c - 1][from] + gain(from, to);
        if (sum <= best[c][to]) continue;
        best[c][to] = sum;
        cut[c][to] = from;
      }
  std::vector<std::size_t> limits;
  for (std::size_t c = classes, to = bins; c > 1; --c) {
    to = cut[c][to];
    limits.push_back(to);
  }
  std::reverse(limits.begin(), limits.end());
  return limits;
}

}  // namespace

VolumeHistogram histogram(const Volume& volume, const HistogramOptions& options) {
  if (options.bins < 2 || options.bins > 65536)
    throw UsageError(fmt::format("there are {} bins; give 2 to 65536", options.bins));
  if (options.classes < 2 || options.classes > 6)
    throw UsageError(fmt::format("there are {} classes; give 2 to 6", options.classes));
  VolumeHistogram result;
  auto bins = static_cast<std::size_t>(options.bins);
  result.low = volume.lowest();
  result.high = volume.highest();
  const double step = std::abs(volume.scale().slope);
  const double numbers = std::round((result.high - result.low) / step) + 1;
  if (volume.type() != VolumeType::F32 && numbers <= static_cast<double>(bins)) {
    // One bin for each number, with the number in its middle.
    bins = static_cast<std::size_t>(numbers);
    result.low -= step / 2;
    result.high += step / 2;
  }
  const double width = (result.high - result.low) / static_cast<double>(bins);
  const auto binOf = [&](double value) {
    if (!(width > 0)) return std::size_t{0};
    return std::min(bins - 1,
                    static_cast<std::size_t>(std::max(0.0, (value - result.low) / width)));
  };

  const Imath::V3i size = volume.size();
  const Imath::M33d map = gradientMap(volume.grid().indexToWorld);
  result.counts.assign(bins, 0);
  std::vector<double> gradients(bins, 0);
  // Layers are summed one after another, so that the sums do not depend on threads.
  constexpr int kSlice = 16;
  std::vector<HistogramPart> slice(kSlice);
  for (int from = 0; from < size.z; from += kSlice) {
    const int count = std::min(kSlice, size.z - from);
    tbb::parallel_for(0, count, [&](int n) {
      HistogramPart& part = slice[static_cast<std::size_t>(n)];
      part.counts.assign(bins, 0);
      part.gradients.assign(bins, 0);
      for (int j = 0; j < size.y; ++j)
        for (int i = 0; i < size.x; ++i) {
          const Imath::V3i at(i, j, from + n);
          const std::size_t bin = binOf(volume.at(at.x, at.y, at.z));
          const Imath::V3d byIndex(slopeAlong(volume, at, 0), slopeAlong(volume, at, 1),
                                   slopeAlong(volume, at, 2));
          ++part.counts[bin];
          part.gradients[bin] += (byIndex * map).length();
        }
    });
    for (int n = 0; n < count; ++n)
      for (std::size_t bin = 0; bin < bins; ++bin) {
        result.counts[bin] += slice[static_cast<std::size_t>(n)].counts[bin];
        gradients[bin] += slice[static_cast<std::size_t>(n)].gradients[bin];
      }
    report(options.progress, static_cast<double>(from + count) / size.z);
  }

  // === Suggestions
  result.meanGradient.assign(bins, 0);
  const std::uint64_t fullest = *std::max_element(result.counts.begin(), result.counts.end());
  const double enough = 1e-3 * static_cast<double>(volume.grid().pointCount() - fullest);
  std::size_t steepest = 0;
  double most = -1;
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const auto count = static_cast<double>(result.counts[bin]);
    if (count > 0) result.meanGradient[bin] = gradients[bin] / count;
    if (count <= 0 || count < enough || result.meanGradient[bin] <= most) continue;
    most = result.meanGradient[bin];
    steepest = bin;
  }
  result.steepest = result.center(steepest);
  // Dynamic programming takes bins² steps, so many bins are joined.
  constexpr std::size_t kMostBins = 1024;
  const std::size_t joined = (bins + kMostBins - 1) / kMostBins;
  std::vector<std::uint64_t> coarse((bins + joined - 1) / joined, 0);
  for (std::size_t bin = 0; bin < bins; ++bin) coarse[bin / joined] += result.counts[bin];
  const std::size_t classes = std::min<std::size_t>(static_cast<std::size_t>(options.classes),
                                                    std::max<std::size_t>(coarse.size(), 1));
  if (classes > 1)
    for (const std::size_t limit : otsuLimits(coarse, classes))
      result.otsu.push_back(result.low + static_cast<double>(limit * joined) * width);
  return result;
}

}  // namespace levelset
