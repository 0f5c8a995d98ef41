#pragma once

#include <array>

#include "levelset/splines/bernstein_form.h"

namespace levelset {

/// Univariate polynomial in Bernstein form on an interval [a, b]. Barycentric coordinates of x are
/// ((b − x) / (b − a), (x − a) / (b − a)); coefficient i belongs to a + i (b − a) / degree.
template <int Degree, class Scalar = double>
using BernsteinLine = BernsteinForm<2, Degree, Scalar>;

/// Returns the value at the parameter t, 0 at the begin of the interval and 1 at its end.
template <int Degree, class Scalar>
Scalar lineValue(const BernsteinForm<2, Degree, Scalar>& line, const Scalar& t) {
  return line.value({Scalar(1) - t, t});
}

/// Returns the derivative by the parameter t. Divide by b − a for the derivative by x.
template <int Degree, class Scalar>
Scalar lineDerivative(const BernsteinForm<2, Degree, Scalar>& line, const Scalar& t) {
  return line.derivative({Scalar(1) - t, t}, {Scalar(-1), Scalar(1)});
}

/// Returns the coefficients of 1, t, t², … for root finders. The coefficient n is C(degree, n)
/// times the forward difference of order n of the first Bernstein coefficients.
template <int Degree, class Scalar>
std::array<Scalar, Degree + 1> monomialCoefficients(const BernsteinForm<2, Degree, Scalar>& line) {
  std::array<Scalar, Degree + 1> differences = line.coefficients;
  std::array<Scalar, Degree + 1> result{};
  int binomial = 1;
  for (int n = 0; n <= Degree; ++n) {
    result[n] = Scalar(binomial) * differences[0];
    for (int i = 0; i + n < Degree; ++i) differences[i] = differences[i + 1] - differences[i];
    binomial = binomial * (Degree - n) / (n + 1);
  }
  return result;
}

}  // namespace levelset
