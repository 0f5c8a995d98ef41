#include "levelset/hamilton_jacobi/upwind_derivative.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "levelset/error.h"

namespace levelset::flow {
namespace {

/// Fifth-order weighted, essentially non-oscillatory derivative from five differences in the
/// direction of the flow [Jiang00].
double weno5(double a, double b, double c, double d, double e) {
  const double s1 = 13.0 / 12 * (a - 2 * b + c) * (a - 2 * b + c) +
                    0.25 * (a - 4 * b + 3 * c) * (a - 4 * b + 3 * c);
  const double s2 = 13.0 / 12 * (b - 2 * c + d) * (b - 2 * c + d) + 0.25 * (b - d) * (b - d);
  const double s3 = 13.0 / 12 * (c - 2 * d + e) * (c - 2 * d + e) +
                    0.25 * (3 * c - 4 * d + e) * (3 * c - 4 * d + e);
  // The differences are about 1, since |∇φ| ≈ 1, so the regularisation can be absolute.
  constexpr double kSmall = 1e-6;
  const double w1 = 0.1 / ((s1 + kSmall) * (s1 + kSmall)),
               w2 = 0.6 / ((s2 + kSmall) * (s2 + kSmall)),
               w3 = 0.3 / ((s3 + kSmall) * (s3 + kSmall));
  return (w1 * (2 * a - 7 * b + 11 * c) + w2 * (-b + 5 * c + 2 * d) + w3 * (2 * c + 5 * d - e)) /
         (6 * (w1 + w2 + w3));
}

double smaller(double a, double b) {
  return std::abs(a) <= std::abs(b) ? a : b;
}

/// Essentially non-oscillatory derivative of order 2 or 3 from the first differences d.
double eno(const std::array<double, 5>& d, int order) {
  // Second differences, around the points behind the grid point and at it.
  const double behind = d[2] - d[1], here = d[3] - d[2];
  const bool isBehind = std::abs(behind) <= std::abs(here);
  const double second = d[2] + (isBehind ? behind : here) / 2;
  if (order == 2) return second;
  const double farBehind = d[1] - d[0], ahead = d[4] - d[3];
  return second + (isBehind ? smaller(behind - farBehind, here - behind) / 3
                            : -smaller(here - behind, ahead - here) / 6);
}

}  // namespace

void requireOrders(const UpwindOrders& orders) {
  if (std::find(std::begin(kUpwindOrders), std::end(kUpwindOrders), orders.space) ==
      std::end(kUpwindOrders))
    throw UsageError(
        fmt::format("the upwind scheme has no order {} in space; give 1, 2, 3 or 5", orders.space));
  if (orders.time < 1 || orders.time > 3)
    throw UsageError(
        fmt::format("the upwind scheme has no order {} in time; give 1, 2 or 3", orders.time));
}

double upwindDerivative(const std::array<double, 6>& values, int order) {
  std::array<double, 5> d;
  for (std::size_t k = 0; k < d.size(); ++k) d[k] = values[k + 1] - values[k];
  if (order == 1) return d[2];
  return order == 5 ? weno5(d[0], d[1], d[2], d[3], d[4]) : eno(d, order);
}

}  // namespace levelset::flow
