#pragma once

namespace render {

/// What is drawn of a grid: the zero set of which function through its values.
enum class Filter {
  /// Between the values.
  Trilinear,
  /// Tricubic B-spline with the values for coefficients: smooth, and off by a sixth of the
  /// Laplacian.
  BSpline,
  /// The same with the coefficients f − ∇²f/6: on the values to fourth order [Sigg05].
  BSplineQi
};

[[nodiscard]] constexpr const char* filterName(Filter filter) {
  switch (filter) {
    case Filter::BSpline:
      return "bspline";
    case Filter::BSplineQi:
      return "bspline-qi";
    default:
      return "trilinear";
  }
}

}  // namespace render
