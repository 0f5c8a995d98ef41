#pragma once

#include <array>

#include "levelset/splines/barycentric.h"
#include "levelset/splines/bernstein_form.h"

namespace levelset {

/// Polynomial on a triangle [v0, v1, v2]. Coefficient ijk belongs to the domain point
/// (i v0 + j v1 + k v2) / degree.
template <int Degree, class Scalar = double>
using BernsteinTriangle = BernsteinForm<3, Degree, Scalar>;

/// Returns the gradient at a point of a triangle of the plane, per unit of its coordinates.
template <int Degree, class Scalar>
std::array<Scalar, 2> gradientAt(const BernsteinForm<3, Degree, Scalar>& form,
                                 const BarycentricMap<3, Scalar>& map,
                                 const std::array<Scalar, 3>& weights) {
  return map.gradient(form.barycentricGradient(weights));
}

/// Returns the second derivatives at a point of a triangle of the plane.
template <int Degree, class Scalar>
std::array<std::array<Scalar, 2>, 2> hessianAt(const BernsteinForm<3, Degree, Scalar>& form,
                                               const BarycentricMap<3, Scalar>& map,
                                               const std::array<Scalar, 3>& weights) {
  return map.hessian(form.barycentricHessian(weights));
}

}  // namespace levelset
