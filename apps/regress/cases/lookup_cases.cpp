#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "apps/regress/recorder.h"

namespace regress {

namespace {

/// Offsets and weight of the two linear look-ups that give a cubic B-spline [Sigg05]:
/// (1 − g) f(x − h0) + g f(x + h1).
struct TwoLookups {
  double h0 = 0, h1 = 0, g = 0;
};

/// Weights of the four samples around a position, at the fraction a in [0, 1) of the cell.
std::array<double, 4> cubicWeights(double a) {
  return {(((-a + 3) * a - 3) * a + 1) / 6, ((3 * a - 6) * a * a + 4) / 6,
          (((-3 * a + 3) * a + 3) * a + 1) / 6, a * a * a / 6};
}

TwoLookups exactLookups(double a) {
  const std::array<double, 4> w = cubicWeights(a);
  return {1 - w[1] / (w[0] + w[1]) + a, 1 + w[3] / (w[2] + w[3]) - a, w[2] + w[3]};
}

/// A table of the offsets and the weight in 128 texels of 16 bits, as published.
class LookupTable {
 public:
  LookupTable() {
    for (std::size_t n = 0; n < kTexels; ++n) {
      const TwoLookups exact = exactLookups((static_cast<double>(n) + 0.5) / kTexels);
      texels_[n] = {rounded(exact.h0), rounded(exact.h1), rounded(exact.g)};
    }
  }

  [[nodiscard]] TwoLookups nearest(double a) const {
    return texels_[std::min(static_cast<std::size_t>(a * kTexels), kTexels - 1)];
  }
  /// Linear interpolation. @param wraps  beyond the ends follow the other end (true) or the end
  [[nodiscard]] TwoLookups linear(double a, bool wraps) const {
    const double position = a * kTexels - 0.5, below = std::floor(position);
    const double share = position - below;
    const auto texel = [&](double n) {
      if (n < 0) n = wraps ? kTexels - 1 : 0;
      if (n > kTexels - 1) n = wraps ? 0 : kTexels - 1;
      return texels_[static_cast<std::size_t>(n)];
    };
    const TwoLookups low = texel(below), high = texel(below + 1);
    const auto mix = [&](double x, double y) { return x + (y - x) * share; };
    return {mix(low.h0, high.h0), mix(low.h1, high.h1), mix(low.g, high.g)};
  }

 private:
  static constexpr std::size_t kTexels = 128;
  static double rounded(double x) { return std::round(x * 65535) / 65535; }
  std::array<TwoLookups, kTexels> texels_;
};

using Samples = std::array<double, 4>;

/// Linear interpolation of samples at −1, 0, 1 and 2. @param steps  0, or the fraction is rounded
/// to a multiple of 1/steps, as the texture units of GPUs do
double linearAt(const Samples& samples, double x, double steps) {
  const double below = std::clamp(std::floor(x), -1.0, 1.0);
  double share = x - below;
  if (steps > 0) share = std::round(share * steps) / steps;
  const auto n = static_cast<std::size_t>(below + 1);
  return samples[n] * (1 - share) + samples[n + 1] * share;
}

struct LookupError {
  double largest = 0, mean = 0;
};

LookupError errorOf(const std::function<TwoLookups(double)>& lookups, double steps) {
  constexpr int kRuns = 200'000;
  std::mt19937_64 random(5);
  const auto next = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  LookupError error;
  for (int run = 0; run < kRuns; ++run) {
    const Samples samples = {next(), next(), next(), next()};
    const double a = next();
    const std::array<double, 4> weights = cubicWeights(a);
    double exact = 0;
    for (std::size_t n = 0; n < 4; ++n) exact += weights[n] * samples[n];
    const TwoLookups two = lookups(a);
    const double found = (1 - two.g) * linearAt(samples, a - two.h0, steps) +
                         two.g * linearAt(samples, a + two.h1, steps);
    const double off = std::abs(found - exact);
    error.largest = std::max(error.largest, off);
    error.mean += off / kRuns;
  }
  return error;
}

void lookups(Recorder& out) {
  struct Way {
    const char* name;
    LookupError published, measured;  // [Sigg05] with corrected formulas; here
    std::function<TwoLookups(double)> lookups;
    double steps = 0;
  };
  const LookupTable table;
  const std::vector<Way> ways = {
      {"offsets computed, fractions exact", {1.8e-15, 2e-16}, {4.4e-16, 4.8e-17}, exactLookups},
      {"table of 128 texels of 16 bits, nearest",
       {3.4e-3, 7.8e-4},
       {5.1e-3, 6.7e-4},
       [&](double a) { return table.nearest(a); }},
      {"the same, interpolated, repeated at its ends",
       {1.9e-1, 4.9e-4},
       {2.2e-1, 4.0e-4},
       [&](double a) { return table.linear(a, true); }},
      {"the same, interpolated, clamped at its ends",
       {1.8e-3, 6.7e-6},
       {2.1e-3, 4.8e-6},
       [&](double a) { return table.linear(a, false); }},
      {"offsets computed, fractions of 8 bits",
       {1.5e-3, 2.8e-4},
       {1.7e-3, 2.6e-4},
       exactLookups,
       256}};
  for (const Way& way : ways)
    out.expect(way.name,
               fmt::format("largest {:.2g}, mean {:.2g} (other data: {:.2g}, {:.2g})",
                           way.measured.largest, way.measured.mean, way.published.largest,
                           way.published.mean),
               [&] {
                 const LookupError error = errorOf(way.lookups, way.steps);
                 return std::pair(
                     isAsMeasured(error.largest, way.measured.largest) &&
                         isAsMeasured(error.mean, way.measured.mean),
                     fmt::format("largest {:.2g}, mean {:.2g}", error.largest, error.mean));
               });
}

}  // namespace

void addLookupCases(std::vector<Case>& all) {
  all.push_back(statedCase(
      "lookup-tables", "errors of cubic B-splines by two linear look-ups",
      "Random data in [0, 1]. A cubic B-spline is the weighted sum of two linear interpolations at "
      "computed offsets. Offsets and weight come from their formulas or from a table of 128 texels "
      "of 16 bits; the fractions of the linear interpolation are exact or have 8 bits, as in "
      "texture units. Expected are the errors against the exact spline, computed again with the "
      "corrected formulas. A table that is repeated at its ends, as printed, fails there, because "
      "the offsets jump from one cell to the next.",
      "Sigg05", lookups));
}

}  // namespace regress
