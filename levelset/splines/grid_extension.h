#pragma once

#include <algorithm>
#include <array>
#include <utility>

#include "levelset/error.h"
#include "levelset/splines/tetrahedral_spline.h"

namespace levelset {

/// Rule for the data beyond the border of a grid, axis by axis. A spline of order two keeps its
/// order up to the border only with data that continue smoothly.
enum class GridExtension {
  Clamp,     ///< datum of the border. Errors there: values O(h), gradients O(1)
  Linear,    ///< line through two data. Errors there: values O(h²), gradients O(h)
  Quadratic  ///< parabola through three data. Errors there: values and gradients O(h²)
};

/// Data along one axis that stand for a datum: whole weights that sum to one.
struct ExtensionWeights {
  int count = 1;
  std::array<int, 3> index{};
  std::array<long long, 3> weight{1, 0, 0};
};

/// Returns the data that stand for the datum n of an axis with `size` data.
constexpr ExtensionWeights extensionWeights(int n, int size, GridExtension rule) {
  const int last = size - 1;
  if (n >= 0 && n <= last) return {1, {n, 0, 0}, {1, 0, 0}};
  const int border = n < 0 ? 0 : last, inward = n < 0 ? 1 : -1;
  const long long d = n < 0 ? -static_cast<long long>(n) : n - last;
  const int points = std::min(rule == GridExtension::Clamp    ? 1
                              : rule == GridExtension::Linear ? 2
                                                              : 3,
                              size);
  if (points == 1) return {1, {border, 0, 0}, {1, 0, 0}};
  if (points == 2) return {2, {border, border + inward, 0}, {1 + d, -d, 0}};
  return {3,
          {border, border + inward, border + 2 * inward},
          {(d + 1) * (d + 2) / 2, -d * (d + 2), d * (d + 1) / 2}};
}

/// Data of a box of a grid, extended to all whole numbers. An axis with fewer data than the rule
/// needs uses the rule of its number of data.
template <GridSample Sample>
class ExtendedGrid {
 public:
  using Scalar = SampleScalar<Sample>;

  /// @param sample  called for 0 ≤ i < size[0], and likewise j and k
  /// @throws UsageError if a size is not positive
  ExtendedGrid(Sample sample, const std::array<int, 3>& size, GridExtension rule)
      : sample_(std::move(sample)), size_(size), rule_(rule) {
    if (std::min({size[0], size[1], size[2]}) < 1)
      throw UsageError("a grid needs one sample or more along each axis");
  }

  Scalar operator()(int i, int j, int k) const {
    if (isInside(i, 0) && isInside(j, 1) && isInside(k, 2)) return sample_(i, j, k);
    const ExtensionWeights x = extensionWeights(i, size_[0], rule_),
                           y = extensionWeights(j, size_[1], rule_),
                           z = extensionWeights(k, size_[2], rule_);
    Scalar sum(0);
    for (int c = 0; c < z.count; ++c)
      for (int b = 0; b < y.count; ++b)
        for (int a = 0; a < x.count; ++a)
          sum += Scalar(x.weight[a] * y.weight[b] * z.weight[c]) *
                 Scalar(sample_(x.index[a], y.index[b], z.index[c]));
    return sum;
  }

 private:
  [[nodiscard]] bool isInside(int n, int axis) const { return n >= 0 && n < size_[axis]; }

  Sample sample_;
  std::array<int, 3> size_;
  GridExtension rule_;
};

}  // namespace levelset
