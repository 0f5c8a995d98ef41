#include "apps/regress/truth/kalbe_functions.h"

#include <cmath>
#include <numbers>

namespace regress {

using Imath::V3d;

namespace {

/// Derivative of exp(−a (x − c)²), of order 0 to 2.
double gaussian(double a, double c, double x, int order) {
  const double u = x - c, value = std::exp(-a * u * u);
  if (order == 0) return value;
  return order == 1 ? -2 * a * u * value : (4 * a * a * u * u - 2 * a) * value;
}

/// Derivative of cos(2π f_M cos(π r / 2)) by x, where r is the distance from the z axis.
double ripples(double x, double y, int order) {
  constexpr double kPi = std::numbers::pi, kFrequency = 6;
  const double r = std::hypot(x, y), angle = kPi * r / 2;
  const double phase = 2 * kPi * kFrequency * std::cos(angle);
  if (order == 0) return std::cos(phase);
  // g(r) = cos(phase(r)); the derivative by x is g′ x / r. phase′ / r is smooth at r = 0.
  const double perRadius = r > 1e-9 ? std::sin(angle) / r : kPi / 2;
  const double slope = -2 * kPi * kFrequency * (kPi / 2) * perRadius;  // phase′ / r
  if (order == 1) return -std::sin(phase) * slope * x;
  const double bend = -2 * kPi * kFrequency * (kPi * kPi / 4) * std::cos(angle);  // phase″
  const double first = -std::sin(phase) * slope;                                  // g′ / r
  const double second = -std::cos(phase) * slope * slope * r * r - std::sin(phase) * bend;
  const double share = r > 1e-9 ? x * x / (r * r) : 1;
  return second * share + first * (1 - share);
}

constexpr double kAlpha = 0.25;

}  // namespace

KalbeColumn kalbeColumn(double x, double y, int order) {
  const auto g = [&](double a, double cx, double cy) {
    return gaussian(a, cx, x, order) * gaussian(a, cy, y, 0);
  };
  KalbeColumn c;
  c.constant = V3d(0, 0.5 * g(10, 0.25, 0.25) - 0.25 * g(20, 0.75, 0.75),
                   kAlpha * ((order == 0 ? 1 : 0) + ripples(x, y, order)) / (2 * (1 + kAlpha)));
  c.first = V3d(g(5, 0.5, 0) + g(5, 0, 0.5), 0.75 * g(16, 0.25, 0.25), order == 0 ? 1 : 0);
  c.second = V3d(0, 0.5 * g(10, 0.75, 0.125), 0);
  return c;
}

KalbeHeight kalbeHeight(double z) {
  KalbeHeight h;
  h.first = V3d(gaussian(5, 0, z, 0), gaussian(16, 0.25, z, 0),
                (1 - std::sin(std::numbers::pi * z / 2)) / (2 * (1 + kAlpha)));
  h.second = V3d(0, gaussian(10, 0.5, z, 0), 0);
  return h;
}

}  // namespace regress
