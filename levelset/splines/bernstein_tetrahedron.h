#pragma once

#include <array>

#include "levelset/splines/barycentric.h"
#include "levelset/splines/bernstein_form.h"
#include "levelset/splines/bernstein_line.h"

namespace levelset {

/// Polynomial on a tetrahedron [v0, v1, v2, v3]. Coefficient ijkl belongs to the domain point
/// (i v0 + j v1 + k v2 + l v3) / degree. The values lie between the smallest and the largest
/// coefficient.
template <int Degree, class Scalar = double>
using BernsteinTetrahedron = BernsteinForm<4, Degree, Scalar>;

/// Returns the gradient at a point of a tetrahedron, per unit of its coordinates.
template <int Degree, class Scalar>
std::array<Scalar, 3> gradientAt(const BernsteinForm<4, Degree, Scalar>& form,
                                 const BarycentricMap<4, Scalar>& map,
                                 const std::array<Scalar, 4>& weights) {
  return map.gradient(form.barycentricGradient(weights));
}

/// Returns the second derivatives at a point of a tetrahedron.
template <int Degree, class Scalar>
std::array<std::array<Scalar, 3>, 3> hessianAt(const BernsteinForm<4, Degree, Scalar>& form,
                                               const BarycentricMap<4, Scalar>& map,
                                               const std::array<Scalar, 4>& weights) {
  return map.hessian(form.barycentricHessian(weights));
}

/// Returns the polynomial along a segment. Its parameter is 0 at `a` and 1 at `b`.
template <int Degree, class Scalar>
BernsteinLine<Degree, Scalar> restrictToSegment(const BernsteinForm<4, Degree, Scalar>& form,
                                                const BarycentricMap<4, Scalar>& map,
                                                const std::array<Scalar, 3>& a,
                                                const std::array<Scalar, 3>& b) {
  return form.restriction(map.coordinates(a), map.coordinates(b));
}

}  // namespace levelset
