#pragma once

#include <array>

namespace render {

/// Interpolation of a grid's values. Renderers draw the zero set of the interpolating function.
enum class Filter {
  /// Trilinear interpolation.
  Trilinear,
  /// Cubic convolution along each axis, also called Catmull-Rom spline [Keys81]. It interpolates
  /// the
  /// values.
  Tricubic,
  /// Tricubic B-spline whose coefficients are the grid values. It is smooth, but at grid points it
  /// differs from the values by about a sixth of their discrete Laplacian.
  BSpline,
  /// Quasi-interpolating tricubic B-spline with coefficients f − ∇²f/6: its error is of fourth
  /// order in the voxel size [Sigg05].
  BSplineQi,
  /// Quadratic super spline on the type-6 partition, smooth but for the middles of cubes [Kalbe11].
  SuperQuadratic,
  /// Cubic C¹ spline on the type-6 partition [Kalbe11].
  CubicC1,
  /// Quadratic C¹ spline Q₂ on truncated octahedra of a body-centred cubic lattice [Kalbe11].
  BccQuadratic
};

/// All filters, in the order of the enumeration.
inline constexpr std::array kFilters = {
    Filter::Trilinear,      Filter::Tricubic, Filter::BSpline,     Filter::BSplineQi,
    Filter::SuperQuadratic, Filter::CubicC1,  Filter::BccQuadratic};

/// Degree of a spline on the tetrahedra of the type-6 partition; 0 for other filters. The cubes of
/// the partition are centred at the grid points.
[[nodiscard]] constexpr int tetrahedralDegree(Filter filter) {
  return filter == Filter::SuperQuadratic ? 2 : filter == Filter::CubicC1 ? 3 : 0;
}

/// Returns true for filters that are a product of cubics along the axes in each cell.
[[nodiscard]] constexpr bool isTricubicInCells(Filter filter) {
  return filter == Filter::Tricubic || filter == Filter::BSpline || filter == Filter::BSplineQi;
}

[[nodiscard]] constexpr const char* filterName(Filter filter) {
  switch (filter) {
    case Filter::Tricubic:
      return "tricubic";
    case Filter::BSpline:
      return "bspline";
    case Filter::BSplineQi:
      return "bspline-qi";
    case Filter::SuperQuadratic:
      return "super-quadratic";
    case Filter::CubicC1:
      return "cubic-c1";
    case Filter::BccQuadratic:
      return "bcc-quadratic";
    default:
      return "trilinear";
  }
}

}  // namespace render
