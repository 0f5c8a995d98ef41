#pragma once

#include <Imath/ImathVec.h>

#include <array>

namespace regress {

/// Test functions of the tables of [Kalbe11]: blob, fr and ml (Marschner and Lobb, α = 1/4 and
/// f_M = 6). A vector holds one number for each, in this order.
inline constexpr std::array<const char*, 3> kKalbeFunctions = {"blob", "fr", "ml"};

/// Derivative of the test functions by x, of order 0, 1 or 2, as a sum of three products.
/// The functions at (x, y, z) are constant + first · along(z)[0] + second · along(z)[1].
struct KalbeColumn {
  Imath::V3d constant{0.0}, first{0.0}, second{0.0};
};
struct KalbeHeight {
  Imath::V3d first{0.0}, second{0.0};
};

/// @param order  order of the derivative by x, 0 to 2
[[nodiscard]] KalbeColumn kalbeColumn(double x, double y, int order);
[[nodiscard]] KalbeHeight kalbeHeight(double z);

/// Returns the functions, or their derivatives by x, from the factors of a column and a height.
[[nodiscard]] inline Imath::V3d kalbeValue(const KalbeColumn& column, const KalbeHeight& height) {
  return column.constant + column.first * height.first + column.second * height.second;
}

}  // namespace regress
