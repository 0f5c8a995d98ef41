#pragma once

// Interpolation between the samples of a tree, for the .cpp files of this library. BandSampler, the
// resampling kernels and the fields from grids share it.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "levelset/vdb.h"

namespace levelset {

/// Copies the N³ values from grid point `first` on to a dense cube, x slowest. Reads leaf by leaf:
/// along each axis the values lie in one or two leaves.
template <int N, typename Accessor, typename Value>
void gatherSamples(const Accessor& accessor, const openvdb::Coord& first, Value* out) {
  static_assert(N <= 8);
  const auto endOfLeaf = [&](int axis, int from) {
    return std::min(N, from + 8 - ((first[axis] + from) & 7));
  };
  const auto copyPart = [&](const openvdb::Coord& from, const openvdb::Coord& to) {
    const openvdb::Coord start = first + from;
    const auto* leaf = accessor.probeConstLeaf(start);
    const Value* samples = leaf ? leaf->buffer().data() + leaf->coordToOffset(start) : nullptr;
    const Value tile = leaf ? Value(0) : accessor.getValue(start);
    const int count = to[2] - from[2];
    for (int x = from[0]; x < to[0]; ++x)
      for (int y = from[1]; y < to[1]; ++y) {
        Value* row = out + (x * N + y) * N + from[2];
        if (samples)
          std::copy_n(samples + (x - from[0]) * 64 + (y - from[1]) * 8, count, row);
        else
          std::fill_n(row, count, tile);
      }
  };
  openvdb::Coord from(0), to;
  for (from[0] = 0; from[0] < N; from[0] = to[0]) {
    to[0] = endOfLeaf(0, from[0]);
    for (from[1] = 0; from[1] < N; from[1] = to[1]) {
      to[1] = endOfLeaf(1, from[1]);
      for (from[2] = 0; from[2] < N; from[2] = to[2]) {
        to[2] = endOfLeaf(2, from[2]);
        copyPart(from, to);
      }
    }
  }
}

/// Weights of N = 2 (linear) or N = 4 (Catmull-Rom) samples, and their derivatives by t. The
/// position lies at fraction t in [0, 1) between the two middle samples. The weights sum to 1, the
/// derivatives to 0. DenseBlock (distance/interpolant.h) has its own weights: it needs second
/// derivatives, in single precision.
template <int N>
struct AxisWeights {
  std::array<double, N> weight, slope;

  explicit AxisWeights(double t) {
    static_assert(N == 2 || N == 4);
    if constexpr (N == 2) {
      weight = {1 - t, t};
      slope = {-1, 1};
    } else {
      weight = {t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (1.5 * t - 2.5),
                t * (0.5 + t * (2 - 1.5 * t)), t * t * (0.5 * t - 0.5)};
      slope = {-0.5 + t * (2 - 1.5 * t), t * (4.5 * t - 5), 0.5 + t * (4 - 4.5 * t),
               t * (1.5 * t - 1)};
    }
  }
};

/// The N³ samples around an index position, x slowest, and the position as a fraction of its cell.
template <int N>
struct SampleBlock {
  /// Number of samples on each axis before the lowest corner of the cell that holds the position.
  static constexpr int kBefore = N / 2 - 1;
  openvdb::Coord origin;  ///< index coordinates of the first sample
  openvdb::Vec3d fraction;
  std::array<float, N * N * N> values;

  template <typename Accessor>
  SampleBlock(const Accessor& accessor, const openvdb::Vec3d& index) : SampleBlock(index) {
    gatherSamples<N>(accessor, origin, values.data());
  }

  /// Leaves `values` unset: only allActive() may be called.
  explicit SampleBlock(const openvdb::Vec3d& index) {
    for (int axis = 0; axis < 3; ++axis) {
      const double cell = std::fmax(-kFarthest, std::fmin(kFarthest, std::floor(index[axis])));
      origin[axis] = static_cast<int>(cell) - kBefore;
      fraction[axis] = std::clamp(index[axis] - cell, 0.0, 1.0);
    }
  }

  /// Returns true when all N³ samples are active.
  template <typename Accessor>
  [[nodiscard]] bool allActive(const Accessor& accessor) const {
    if (isInOneLeaf()) {
      const auto* leaf = accessor.probeConstLeaf(origin);
      if (!leaf) return false;
      const std::uint64_t pattern = rowPattern();
      for (int x = 0; x < N; ++x) {
        const auto row = static_cast<openvdb::Index>((origin[0] & 7) + x);
        const auto word = leaf->valueMask().template getWord<std::uint64_t>(row);
        if ((word & pattern) != pattern) return false;
      }
      return true;
    }
    openvdb::Coord c;
    for (int x = 0; x < N; ++x)
      for (int y = 0; y < N; ++y)
        for (int z = 0; z < N; ++z)
          if (!accessor.isValueOn(origin.offsetBy(x, y, z))) return false;
    return true;
  }

  /// Returns true when a sample holds exactly ± background.
  [[nodiscard]] bool touches(float background) const {
    for (const float v : values)
      if (std::abs(v) == background) return true;
    return false;
  }

  [[nodiscard]] double value() const {
    const AxisWeights<N> wx(fraction[0]), wy(fraction[1]), wz(fraction[2]);
    double sum = 0;
    for (int x = 0; x < N; ++x)
      for (int y = 0; y < N; ++y) sum += wx.weight[x] * wy.weight[y] * row(x, y, wz.weight);
    return sum;
  }

  /// Derivatives by the index coordinates.
  [[nodiscard]] openvdb::Vec3d gradient() const {
    const AxisWeights<N> wx(fraction[0]), wy(fraction[1]), wz(fraction[2]);
    openvdb::Vec3d sum(0, 0, 0);
    for (int x = 0; x < N; ++x) {
      for (int y = 0; y < N; ++y) {
        const double along = row(x, y, wz.weight);
        sum[0] += wx.slope[x] * wy.weight[y] * along;
        sum[1] += wx.weight[x] * wy.slope[y] * along;
        sum[2] += wx.weight[x] * wy.weight[y] * row(x, y, wz.slope);
      }
    }
    return sum;
  }

 private:
  // Positions beyond this index coordinate, and NaN, are clamped to it, so that they fit into int.
  static constexpr double kFarthest = 2147483000.0;

  [[nodiscard]] bool isInOneLeaf() const {
    return (origin[0] & 7) <= 8 - N && (origin[1] & 7) <= 8 - N && (origin[2] & 7) <= 8 - N;
  }

  /// Returns the bits of the N × N samples in one x-slice of a leaf's mask. The slice has 8 rows
  /// along y, each of 8 bits along z.
  [[nodiscard]] std::uint64_t rowPattern() const {
    const std::uint64_t bits = ((std::uint64_t{1} << N) - 1) << (origin[2] & 7);
    std::uint64_t pattern = 0;
    for (int y = 0; y < N; ++y) pattern |= bits << (8 * ((origin[1] & 7) + y));
    return pattern;
  }

  [[nodiscard]] double row(int x, int y, const std::array<double, N>& weights) const {
    const float* samples = values.data() + (x * N + y) * N;
    double sum = 0;
    for (int z = 0; z < N; ++z) sum += weights[z] * static_cast<double>(samples[z]);
    return sum;
  }
};

}  // namespace levelset
