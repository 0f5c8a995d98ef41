#pragma once

#include <array>
#include <functional>

namespace regress {

/// Errors as the tables of [Kalbe11] state them.
struct KalbeErrors {
  double data = 0;  ///< largest at data points
  double max = 0;   ///< largest at the 220 points of each tetrahedron
  double mean = 0;  ///< mean over these points
  double rms = 0;   ///< root mean square over these points
};

/// Errors of the splines Q_k for the three functions of kKalbeFunctions.
struct KalbeTables {
  using Row = std::array<KalbeErrors, 3>;
  Row valueOfQ3{}, valueOfQ2{};
  Row slopeOfQ2{};   ///< derivative by x
  Row secondOfQ2{};  ///< second derivative by x; only if asked for
};

/// Measures the errors of the splines on the grid of the spacing 1 / n, by the protocol of
/// [Kalbe11]: all whole truncated octahedra with centres in [−½ − h/2, ½ + h/2]³, 144 tetrahedra in
/// each, the domain points of degree 9 in each closed tetrahedron, and data outside the cube from
/// the functions themselves. The second derivative at a data point is that of the worst tetrahedron
/// there.
/// @param withSecond  computes the second derivatives, too
/// @tparam Real  precision of the data, the splines and the functions: float, double, long double.
///               Sums are in double precision
/// @param tick  called many times; may throw
template <class Real = double>
[[nodiscard]] KalbeTables kalbeTables(int n, bool withSecond, const std::function<void()>& tick);

template <>
KalbeTables kalbeTables<float>(int n, bool withSecond, const std::function<void()>& tick);
template <>
KalbeTables kalbeTables<double>(int n, bool withSecond, const std::function<void()>& tick);
template <>
KalbeTables kalbeTables<long double>(int n, bool withSecond, const std::function<void()>& tick);

}  // namespace regress
