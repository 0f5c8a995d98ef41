#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace levelset {

/// Abscissae and weights of Gauss and Legendre on [0, 1].
template <std::size_t N>
struct GaussRule {
  std::array<double, N> at, weight;

  GaussRule() {
    for (std::size_t n = 0; n < N; ++n) {
      double x = std::cos(std::numbers::pi * (static_cast<double>(n) + 0.75) / (N + 0.5));
      double slope = 1;
      for (int step = 0; step < 100; ++step) {
        double last = 1, value = x;
        for (std::size_t k = 2; k <= N; ++k) {
          const double next =
              (static_cast<double>(2 * k - 1) * x * value - static_cast<double>(k - 1) * last) /
              static_cast<double>(k);
          last = value;
          value = next;
        }
        slope = N * (x * value - last) / (x * x - 1);
        const double move = value / slope;
        x -= move;
        if (std::abs(move) < 1e-16) break;
      }
      at[n] = 0.5 * (1 - x);
      weight[n] = 1 / ((1 - x * x) * slope * slope);
    }
  }
};

}  // namespace levelset
