#pragma once

namespace regress {

/// Finds the minimum of a function between `low` and `high` by golden-section search. The function
/// falls up to its minimum and rises after it. The interval shrinks by 0.618 in each step.
/// @return middle of the last interval
template <typename Function>
[[nodiscard]] double goldenSectionMinimum(const Function& f, double low, double high, int steps) {
  constexpr double kGolden = 0.6180339887498949;
  double left = high - kGolden * (high - low), right = low + kGolden * (high - low);
  double atLeft = f(left), atRight = f(right);
  for (int i = 0; i < steps; ++i) {
    if (atLeft < atRight) {
      high = right;
      right = left;
      atRight = atLeft;
      left = high - kGolden * (high - low);
      atLeft = f(left);
    } else {
      low = left;
      left = right;
      atLeft = atRight;
      right = low + kGolden * (high - low);
      atRight = f(right);
    }
  }
  return 0.5 * (low + high);
}

/// Finds the minimum of a function between `low` and `high`: the best of the ends of `intervals`
/// equal intervals, refined by golden-section search in the two intervals beside it.
template <typename Function>
[[nodiscard]] double minimumBySections(const Function& f, double low, double high, int intervals) {
  // The error of the least value is quadratic in that of its place, so 36 steps suffice for double
  // precision: 0.618^36 = 3e-8.
  constexpr int kSteps = 36;
  const auto node = [&](int i) { return low + (high - low) * i / intervals; };
  int best = 0;
  double least = f(node(0));
  for (int i = 1; i <= intervals; ++i)
    if (const double value = f(node(i)); value < least) {
      least = value;
      best = i;
    }
  return goldenSectionMinimum(f, node(best > 0 ? best - 1 : 0),
                              node(best < intervals ? best + 1 : intervals), kSteps);
}

}  // namespace regress
