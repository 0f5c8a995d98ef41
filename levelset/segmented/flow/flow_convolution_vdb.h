#pragma once

// Kernels of the motion of interfaces by mean curvature. Includes OpenVDB: for .cpp files only.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/vdb.h"

namespace levelset {

inline constexpr double kLeastVariance = 0.7;  // voxels²: less differs from the continuous Gaussian
inline constexpr double kDeviations = 4;       // radius of a sampled Gaussian

// Variances, as multiples of the first, and weights of Gaussians whose sum keeps curved interfaces
// that meet at 120°, to first order in the curvature. A single Gaussian turns them by 0.2 times its
// deviation times the curvature, since it averages distances over corners as well.
inline constexpr std::array<std::pair<double, double>, 3> kJunctionGaussians = {
    {{1, 1.90272}, {2, -1.03412}, {4, 0.1314}}};
inline constexpr double kJunctionVariance = 0.36008;  // of the sum, as a multiple of the first
// Largest variance of the sum, voxels²: the widest Gaussian then reaches 14 voxels.
inline constexpr double kLargestJunctionVariance = 1;

/// Kernel of a convolution along all axes.
struct FlowKernel {
  double weight;
  std::vector<float> half;  ///< from the centre
  [[nodiscard]] int radius() const { return static_cast<int>(half.size()) - 1; }
};

/// Half of a sampled Gaussian, from the centre.
inline std::vector<float> halfGaussian(double variance) {
  const int radius = static_cast<int>(std::ceil(kDeviations * std::sqrt(variance)));
  std::vector<double> weights;
  double sum = 0;
  for (int d = 0; d <= radius; ++d) {
    weights.push_back(std::exp(-d * d / (2 * variance)));
    sum += (d == 0 ? 1 : 2) * weights.back();
  }
  std::vector<float> half;
  for (const double weight : weights) half.push_back(static_cast<float>(weight / sum));
  return half;
}

/// Gaussians of an interface flow, by variance and weight.
inline std::vector<std::pair<double, double>> gaussiansFor(double variance, bool hasJunctions) {
  if (!hasJunctions || variance > kLargestJunctionVariance * (1 + 1e-9))
    return {{std::max(variance, kLeastVariance), 1}};
  const double first = std::max(variance / kJunctionVariance, kLeastVariance);
  std::vector<std::pair<double, double>> result;
  for (const auto& [ratio, weight] : kJunctionGaussians) result.emplace_back(ratio * first, weight);
  return result;
}

/// Kernels of a step: Gaussians, and for short steps a mean of them and the identity.
/// @param variance  of the sum, voxels²
inline std::vector<FlowKernel> flowKernels(double variance, bool hasJunctions) {
  std::vector<FlowKernel> kernels;
  double second = 0;
  for (const auto& [wide, weight] : gaussiansFor(variance, hasJunctions)) {
    kernels.push_back({weight, halfGaussian(wide)});
    for (std::size_t d = 1; d < kernels.back().half.size(); ++d)
      second +=
          weight * 2 * static_cast<double>(d * d) * static_cast<double>(kernels.back().half[d]);
  }
  const double share = variance / second;
  for (FlowKernel& kernel : kernels) kernel.weight *= share;
  kernels.push_back({1 - share, {1}});
  return kernels;
}

/// Kernels of a step: away from junctions, and near them. Without the first, values stay.
struct StepKernels {
  std::vector<FlowKernel> smooth, junction;
};

/// Convolves the values of a leaf with kernels along all axes, and adds the results.
class LeafConvolution {
 public:
  static constexpr std::uint32_t kVoxels = 512;

  explicit LeafConvolution(const std::vector<FlowKernel>& kernels) : kernels_(kernels) {
    for (const FlowKernel& kernel : kernels) radius_ = std::max(radius_, kernel.radius());
    side_ = 8 + 2 * radius_;
    padded_.resize(count(side_, side_, side_));
    alongZ_.resize(count(side_, side_, 8));
    alongY_.resize(count(side_, 8, 8));
  }

  template <typename Accessor>
  void run(const Accessor& accessor, const openvdb::Coord& origin,
           std::array<float, kVoxels>& out) {
    copyPaddedLeaf(accessor, origin, radius_, radius_, padded_.data());
    out.fill(0);
    for (const FlowKernel& kernel : kernels_) add(kernel, out);
  }

 private:
  static std::size_t count(int x, int y, int z) { return static_cast<std::size_t>(x * y * z); }

  void add(const FlowKernel& kernel, std::array<float, kVoxels>& out) {
    const int radius = kernel.radius(), side = 8 + 2 * radius, skip = radius_ - radius;
    for (int x = 0; x < side; ++x)
      for (int y = 0; y < side; ++y)
        convolve(kernel.half,
                 padded_.data() + count(x + skip, side_, side_) + count(y + skip, side_, 1) +
                     static_cast<std::size_t>(skip),
                 1, alongZ_.data() + count(x, side, 8) + count(y, 8, 1));
    for (int x = 0; x < side; ++x)
      convolve(kernel.half, alongZ_.data() + count(x, side, 8), 8, alongY_.data() + count(x, 8, 8));
    std::array<float, kVoxels> sum;
    convolve(kernel.half, alongY_.data(), 64, sum.data());
    const auto weight = static_cast<float>(kernel.weight);
    for (std::size_t n = 0; n < kVoxels; ++n) out[n] += weight * sum[n];
  }

  /// Convolves a line of which each value is a row of `width` floats.
  static void convolve(const std::vector<float>& kernel, const float* in, std::size_t width,
                       float* out) {
    const std::size_t radius = kernel.size() - 1;
    for (std::size_t i = 0; i < 8 * width; ++i) {
      const float* centre = in + i + radius * width;
      float sum = kernel[0] * *centre;
      for (std::size_t d = 1; d <= radius; ++d)
        sum += kernel[d] * (*(centre - d * width) + centre[d * width]);
      out[i] = sum;
    }
  }

  const std::vector<FlowKernel>& kernels_;
  int radius_ = 0, side_ = 8;
  std::vector<float> padded_, alongZ_, alongY_;
};

}  // namespace levelset
