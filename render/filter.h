#pragma once

namespace render {

/// What is drawn of a grid: the zero set of which function through its values.
enum class Filter {
  Trilinear,  ///< between the values
  BSpline,    ///< tricubic B-spline with the values for coefficients: smooth, and shrunk by a sixth of
              ///< the Laplacian
  BSplineQi   ///< the same with the coefficients f − ∇²f/6: through the values to fourth order [Sigg05]
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
