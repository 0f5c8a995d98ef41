// Errors of the cubic B-spline by two linear look-ups instead of four values [Sigg05], when
// positions and weights of the look-ups come from a table of 128 entries of 16 bits, or when the
// texture unit has 8 bits for the fraction. Random data in [0, 1], against the exact spline. Exits
// 1 when the mean error differs by more than a quarter from the expected one, or the largest by
// more than its double.
//
//   lookup_errors [POSITIONS]    default 1000000

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace {

constexpr int kEntries = 128;

/// Distances of the two look-ups from the position, to the left and to the right, and the share of
/// the right one.
struct Taps {
  double left, right, share;
};

std::array<double, 4> splineWeights(double a) {
  const double b = 1 - a;
  return {b * b * b / 6, (a * a * (3 * a - 6) + 4) / 6, (b * b * (3 * b - 6) + 4) / 6,
          a * a * a / 6};
}

Taps exactTaps(double a) {
  const std::array<double, 4> w = splineWeights(a);
  return {1 - w[1] / (w[0] + w[1]) + a, 1 + w[3] / (w[2] + w[3]) - a, w[2] + w[3]};
}

/// A value of the table: 16 bits for numbers from 0 to 2.
double stored(double v) {
  return std::round(v / 2 * 65535) / 65535 * 2;
}

enum class Table { None, Nearest, Repeated, Clamped };

class LookUps {
 public:
  explicit LookUps(Table table) : table_(table) {
    for (int i = 0; i < kEntries; ++i) {
      const Taps t = exactTaps((i + 0.5) / kEntries);
      entries_.push_back({stored(t.left), stored(t.right), stored(t.share)});
    }
  }
  [[nodiscard]] Taps at(double a) const {
    if (table_ == Table::None) return exactTaps(a);
    const double place = a * kEntries - 0.5;
    if (table_ == Table::Nearest)
      return entries_[static_cast<std::size_t>(std::clamp(std::lround(place), 0L, kEntries - 1L))];
    const auto low = static_cast<int>(std::floor(place));
    const auto entry = [&](int i) {
      const int held =
          table_ == Table::Repeated ? (i + kEntries) % kEntries : std::clamp(i, 0, kEntries - 1);
      return entries_[static_cast<std::size_t>(held)];
    };
    const Taps b = entry(low), c = entry(low + 1);
    const double f = place - low;
    return {b.left + f * (c.left - b.left), b.right + f * (c.right - b.right),
            b.share + f * (c.share - b.share)};
  }

 private:
  Table table_;
  std::vector<Taps> entries_;
};

/// Linear look-up in the data. @param levels  number of steps of the fraction; 0: exact
double linear(const std::array<double, 4>& data, double place, int levels) {
  const auto cell = static_cast<std::size_t>(std::clamp(place, 0.0, 2.0));
  double f = place - static_cast<double>(cell);
  if (levels > 0) f = std::round(f * levels) / levels;
  return data[cell] * (1 - f) + data[cell + 1] * f;
}

}  // namespace

int main(int argc, char** argv) {
  const int positions = argc > 1 ? std::stoi(argv[1]) : 1000000;
  struct Row {
    std::string name;
    Table table;
    int levels;
    double most, mean;  // expected errors
  };
  const Row rows[] = {{"exact fractions", Table::None, 0, 1.8e-15, 2e-16},
                      {"table, nearest entry", Table::Nearest, 0, 3.4e-3, 7.8e-4},
                      {"table, linear, repeated", Table::Repeated, 0, 1.9e-1, 4.9e-4},
                      {"table, linear, clamped", Table::Clamped, 0, 1.8e-3, 6.7e-6},
                      {"fraction of 8 bits", Table::None, 256, 1.5e-3, 2.8e-4}};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(0, 1);
  std::array<double, 4> data{};
  bool isGood = true;
  fmt::print("{:<26}{:>10}{:>10}{:>12}{:>10}\n", "", "largest", "mean", "expected:", "");
  for (const Row& row : rows) {
    const LookUps lookUps(row.table);
    double most = 0, sum = 0;
    for (int n = 0; n < positions; ++n) {
      for (double& v : data) v = place(random);
      const double a = place(random);  // between data[1] and data[2]
      const std::array<double, 4> w = splineWeights(a);
      double exact = 0;
      for (std::size_t i = 0; i < 4; ++i) exact += w[i] * data[i];
      const Taps t = lookUps.at(a);
      const double found = linear(data, 1 + a - t.left, row.levels) * (1 - t.share) +
                           linear(data, 1 + a + t.right, row.levels) * t.share;
      most = std::max(most, std::abs(found - exact));
      sum += std::abs(found - exact);
    }
    const double mean = sum / positions;
    const bool isExact = row.table == Table::None && row.levels == 0;  // roundings only
    const bool isHeld = most < 2 * row.most && (isExact || std::abs(mean / row.mean - 1) < 0.25);
    isGood &= isHeld;
    fmt::print("{:<26}{:>10.2g}{:>10.2g}{:>12.2g}{:>10.2g}{}\n", row.name, most, mean, row.most,
               row.mean, isHeld ? "" : "  missed");
  }
  return isGood ? 0 : 1;
}
