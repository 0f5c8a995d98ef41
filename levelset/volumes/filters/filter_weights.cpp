#include "levelset/volumes/filters/filter_weights.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace levelset {
namespace {

/// Weights of successive samples before the border is treated.
struct Taps {
  int count = 0;
  int before = 0;  ///< number of samples below the cell
  std::array<std::array<double, FilterWeights::kMost>, 3> weight{};
  std::array<std::array<double, FilterWeights::kMost>, 3> uncorrected{};  ///< as FilterWeights
};

Taps linearTaps(double a) {
  return {2, 0, {{{1 - a, a}, {-1, 1}, {0, 0}}}, {}};
}

Taps catmullRomTaps(double a) {
  return {
      4,
      1,
      {{{a * (-0.5 + a * (1 - 0.5 * a)), 1 + a * a * (-2.5 + 1.5 * a),
         a * (0.5 + a * (2 - 1.5 * a)), a * a * (-0.5 + 0.5 * a)},
        {-0.5 + a * (2 - 1.5 * a), a * (-5 + 4.5 * a), 0.5 + a * (4 - 4.5 * a), a * (-1 + 1.5 * a)},
        {2 - 3 * a, -5 + 9 * a, 4 - 9 * a, -1 + 3 * a}}}};
}

Taps bsplineTaps(double a) {
  const double b = 1 - a;
  return {4,
          1,
          {{{b * b * b / 6, (4 + a * a * (3 * a - 6)) / 6, (4 + b * b * (3 * b - 6)) / 6,
             a * a * a / 6},
            {-b * b / 2, a * (3 * a - 4) / 2, -b * (3 * b - 4) / 2, a * a / 2},
            {b, 3 * a - 2, 3 * b - 2, a}}}};
}

/// B-spline of the coefficients (8 f_i − f_{i−1} − f_{i+1}) / 6.
Taps quasiInterpolantTaps(double a) {
  const Taps spline = bsplineTaps(a);
  Taps taps{6, 2, {}, {}};
  for (std::size_t order = 0; order < 3; ++order)
    for (std::size_t n = 0; n < 4; ++n) {
      taps.uncorrected[order][n + 1] = spline.weight[order][n];
      const double w = spline.weight[order][n] / 6;
      taps.weight[order][n] -= w;
      taps.weight[order][n + 1] += 8 * w;
      taps.weight[order][n + 2] -= w;
    }
  return taps;
}

/// Value and two derivatives of sin(πx) / (πx).
std::array<double, 3> sinc(double x) {
  constexpr double kPi = std::numbers::pi;
  const double y = kPi * x;
  if (std::abs(y) > 0.3) {
    const double s = std::sin(y) / y, first = (std::cos(y) - s) / y;
    return {s, kPi * first, kPi * kPi * (-s - 2 * first / y)};
  }
  // The closed forms lose digits near zero. The series of sin y / y has the terms (−y²)ⁿ / (2n+1)!.
  std::array<double, 3> sum{};
  double factor = 1;  // (−1)ⁿ / (2n+1)!
  for (int n = 0; n < 8; ++n) {
    const int power = 2 * n;
    sum[0] += factor * std::pow(y, power);
    if (n > 0) {
      sum[1] += factor * power * std::pow(y, power - 1);
      sum[2] += factor * power * (power - 1) * std::pow(y, power - 2);
    }
    factor /= -static_cast<double>((power + 2) * (power + 3));
  }
  return {sum[0], kPi * sum[1], kPi * kPi * sum[2]};
}

Taps windowedSincTaps(double a) {
  constexpr double kRate = std::numbers::pi / 3;
  Taps taps{6, 2, {}};
  std::array<double, 3> total{};
  for (std::size_t n = 0; n < 6; ++n) {
    const double x = a + 2 - static_cast<double>(n);
    const std::array<double, 3> s = sinc(x);
    const double w = 0.5 + 0.5 * std::cos(kRate * x), w1 = -0.5 * kRate * std::sin(kRate * x),
                 w2 = -0.5 * kRate * kRate * std::cos(kRate * x);
    const std::array<double, 3> product = {s[0] * w, s[1] * w + s[0] * w1,
                                           s[2] * w + 2 * s[1] * w1 + s[0] * w2};
    for (std::size_t order = 0; order < 3; ++order) {
      taps.weight[order][n] = product[order];
      total[order] += product[order];
    }
  }
  // Quotient by the sum of the weights, with its derivatives.
  for (std::size_t n = 0; n < 6; ++n) {
    double &w = taps.weight[0][n], &w1 = taps.weight[1][n], &w2 = taps.weight[2][n];
    w /= total[0];
    w1 = (w1 - w * total[1]) / total[0];
    w2 = (w2 - 2 * w1 * total[1] - w * total[2]) / total[0];
  }
  return taps;
}

Taps tapsOf(VolumeFilter filter, double a) {
  switch (filter) {
    case VolumeFilter::Tricubic:
      return catmullRomTaps(a);
    case VolumeFilter::BSpline:
      return bsplineTaps(a);
    case VolumeFilter::BSplineQi:
      return quasiInterpolantTaps(a);
    case VolumeFilter::WindowedSinc:
      return windowedSincTaps(a);
    default:
      return linearTaps(a);
  }
}

}  // namespace

FilterWeights filterWeights(VolumeFilter filter, double position, int size, GridExtension border) {
  FilterWeights result;
  if (filter == VolumeFilter::Box || size == 1) {
    result.first = std::min(static_cast<int>(std::floor(position + 0.5)), size - 1);
    result.weight[0][0] = result.uncorrected[0][0] = 1;
    return result;
  }
  const int cell = std::min(static_cast<int>(position), size - 2);
  const Taps taps = tapsOf(filter, position - cell);
  const int first = cell - taps.before, last = first + taps.count - 1;
  result.first = std::max(first, 0);
  result.count = std::min(last, size - 1) - result.first + 1;
  // The samples that extend the grid are among the first or last three. All filters with samples
  // beyond the border also use these.
  for (int n = first; n <= last; ++n) {
    const ExtensionWeights stand = extensionWeights(n, size, border);
    for (std::size_t order = 0; order < 3; ++order)
      for (std::size_t e = 0; e < static_cast<std::size_t>(stand.count); ++e) {
        const auto to = static_cast<std::size_t>(stand.index[e] - result.first),
                   from = static_cast<std::size_t>(n - first);
        const auto share = static_cast<double>(stand.weight[e]);
        result.weight[order][to] += share * taps.weight[order][from];
        result.uncorrected[order][to] += share * taps.uncorrected[order][from];
      }
  }
  return result;
}

}  // namespace levelset
