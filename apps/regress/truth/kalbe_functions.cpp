#include "apps/regress/truth/kalbe_functions.h"

#include <cmath>
#include <numbers>

namespace regress {

namespace {

/// Derivative of exp(−a (x − c)²), of order 0 to 2.
template <class Real>
Real gaussian(Real a, Real c, Real x, int order) {
  const Real u = x - c, value = std::exp(-a * u * u);
  if (order == 0) return value;
  return order == 1 ? -2 * a * u * value : (4 * a * a * u * u - 2 * a) * value;
}

/// Derivative of cos(2π f_M cos(π r / 2)) by x, where r is the distance from the z axis.
template <class Real>
Real ripples(Real x, Real y, int order) {
  constexpr Real kPi = std::numbers::pi_v<Real>, kFrequency = 6;
  const Real r = std::hypot(x, y), angle = kPi * r / 2;
  const Real phase = 2 * kPi * kFrequency * std::cos(angle);
  if (order == 0) return std::cos(phase);
  // g(r) = cos(phase(r)); the derivative by x is g′ x / r. phase′ / r is smooth at r = 0.
  const bool isCentre = r < Real(1e-9);
  const Real perRadius = isCentre ? kPi / 2 : std::sin(angle) / r;
  const Real slope = -2 * kPi * kFrequency * (kPi / 2) * perRadius;  // phase′ / r
  const Real first = -std::sin(phase) * slope;                       // g′ / r
  if (order == 1) return first * x;
  const Real bend = -2 * kPi * kFrequency * (kPi * kPi / 4) * std::cos(angle);  // phase″
  const Real second = -std::cos(phase) * slope * slope * r * r - std::sin(phase) * bend;
  const Real share = isCentre ? Real(1) : x * x / (r * r);
  return second * share + first * (1 - share);
}

}  // namespace

template <class Real>
KalbeColumn<Real> kalbeColumn(Real x, Real y, int order) {
  constexpr Real kQuarter = 0.25, kHalf = 0.5, kThree = 0.75, kEighth = 0.125;
  const auto g = [&](Real a, Real cx, Real cy) {
    return gaussian<Real>(a, cx, x, order) * gaussian<Real>(a, cy, y, 0);
  };
  // α = 1/4: the factor α / (2 (1 + α)) is 1/10.
  const Real constant = order == 0 ? 1 : 0;
  return {{0, kHalf * g(10, kQuarter, kQuarter) - kQuarter * g(20, kThree, kThree),
           (constant + ripples(x, y, order)) / 10},
          {g(5, kHalf, 0) + g(5, 0, kHalf), kThree * g(16, kQuarter, kQuarter), constant},
          {0, kHalf * g(10, kThree, kEighth), 0}};
}

template <class Real>
KalbeHeight<Real> kalbeHeight(Real z) {
  // The factor 1 / (2 (1 + α)) is 2/5.
  return {{gaussian<Real>(5, 0, z, 0), gaussian<Real>(16, Real(0.25), z, 0),
           (1 - std::sin(std::numbers::pi_v<Real> * z / 2)) * 2 / 5},
          {0, gaussian<Real>(10, Real(0.5), z, 0), 0}};
}

template KalbeColumn<float> kalbeColumn(float, float, int);
template KalbeColumn<double> kalbeColumn(double, double, int);
template KalbeColumn<long double> kalbeColumn(long double, long double, int);
template KalbeHeight<float> kalbeHeight(float);
template KalbeHeight<double> kalbeHeight(double);
template KalbeHeight<long double> kalbeHeight(long double);

}  // namespace regress
