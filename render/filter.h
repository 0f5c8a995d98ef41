#pragma once

namespace render {

/// Interpolation of a grid's values. Renderers draw the zero set of the interpolating function.
enum class Filter {
  /// Trilinear interpolation.
  Trilinear,
  /// Tricubic B-spline whose coefficients are the grid values: smooth, but off by a sixth of the
  /// Laplacian.
  BSpline,
  /// Quasi-interpolating tricubic B-spline with coefficients f − ∇²f/6: it meets the values to
  /// fourth order [Sigg05].
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
