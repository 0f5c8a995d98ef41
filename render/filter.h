#pragma once

namespace render {

/// Interpolation of a grid's values. Renderers draw the zero set of the interpolating function.
enum class Filter {
  /// Trilinear interpolation.
  Trilinear,
  /// Tricubic B-spline whose coefficients are the grid values. It is smooth, but at grid points it
  /// differs from the values by about a sixth of their discrete Laplacian.
  BSpline,
  /// Quasi-interpolating tricubic B-spline with coefficients f − ∇²f/6: its error is of fourth
  /// order in the voxel size [Sigg05].
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
