#pragma once

#include <array>
#include <cstddef>

namespace regress {

/// Test functions of the tables of [Kalbe11]: blob, fr and ml [MarschnerLobb94], with α = 1/4 and
/// f_M = 6.
inline constexpr std::array<const char*, 3> kKalbeFunctions = {"blob", "fr", "ml"};

/// One number for each test function, with arithmetic function by function.
template <class Real>
struct KalbeNumbers {
  std::array<Real, 3> of{};

  KalbeNumbers() = default;
  explicit KalbeNumbers(int all) { of.fill(static_cast<Real>(all)); }
  KalbeNumbers(Real blob, Real fr, Real ml) : of{blob, fr, ml} {}

  KalbeNumbers& operator+=(const KalbeNumbers& b) {
    for (std::size_t f = 0; f < 3; ++f) of[f] += b.of[f];
    return *this;
  }
  KalbeNumbers& operator/=(const KalbeNumbers& b) {
    for (std::size_t f = 0; f < 3; ++f) of[f] /= b.of[f];
    return *this;
  }
  KalbeNumbers operator-() const { return {-of[0], -of[1], -of[2]}; }
  friend KalbeNumbers operator+(KalbeNumbers a, const KalbeNumbers& b) { return a += b; }
  friend KalbeNumbers operator-(const KalbeNumbers& a, const KalbeNumbers& b) { return a + -b; }
  friend KalbeNumbers operator*(const KalbeNumbers& a, const KalbeNumbers& b) {
    return {a.of[0] * b.of[0], a.of[1] * b.of[1], a.of[2] * b.of[2]};
  }
  friend KalbeNumbers operator*(Real a, const KalbeNumbers& b) {
    return {a * b.of[0], a * b.of[1], a * b.of[2]};
  }
  friend KalbeNumbers operator/(KalbeNumbers a, const KalbeNumbers& b) { return a /= b; }
};

/// Derivative of the test functions by x, of order 0, 1 or 2, as a sum of three products.
/// The functions at (x, y, z) are constant + first · along(z)[0] + second · along(z)[1].
/// The precision is that of `Real`.
template <class Real>
struct KalbeColumn {
  KalbeNumbers<Real> constant, first, second;
};
template <class Real>
struct KalbeHeight {
  KalbeNumbers<Real> first, second;
};

/// @param order  order of the derivative by x, 0 to 2
template <class Real>
[[nodiscard]] KalbeColumn<Real> kalbeColumn(Real x, Real y, int order);
template <class Real>
[[nodiscard]] KalbeHeight<Real> kalbeHeight(Real z);

/// Returns the functions, or their derivatives by x, from the factors of a column and a height.
template <class Real>
[[nodiscard]] KalbeNumbers<Real> kalbeValue(const KalbeColumn<Real>& column,
                                            const KalbeHeight<Real>& height) {
  return column.constant + column.first * height.first + column.second * height.second;
}

}  // namespace regress
