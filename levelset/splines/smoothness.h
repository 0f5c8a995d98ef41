#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "levelset/splines/bernstein_form.h"

namespace levelset {

/// Triangle shared by two tetrahedra, as positions of its vertices in each of them.
struct SharedFace {
  std::array<int, 3> first{}, second{};  ///< first[i] and second[i] are the same vertex
  int firstApex = 0, secondApex = 0;     ///< vertices opposite the triangle
};

/// Finds the triangle that two tetrahedra share. Vertices match if they compare equal: coordinates
/// or vertex numbers.
/// @return empty if they share fewer than three vertices, or all four
template <class Vertex>
std::optional<SharedFace> sharedFace(const std::array<Vertex, 4>& first,
                                     const std::array<Vertex, 4>& second) {
  SharedFace face;
  std::size_t found = 0;
  std::array<bool, 4> isUsed{};
  for (int i = 0; i < 4; ++i) {
    int match = -1;
    for (int j = 0; j < 4; ++j)
      if (first[i] == second[j]) match = j;
    if (match < 0) {
      face.firstApex = i;
    } else {
      if (found == 3) return std::nullopt;
      face.first[found] = i;
      face.second[found++] = match;
      isUsed[match] = true;
    }
  }
  if (found != 3) return std::nullopt;
  for (int j = 0; j < 4; ++j)
    if (!isUsed[j]) face.secondApex = j;
  return face;
}

/// Coefficients of the first tetrahedron in a smoothness condition: positions and factors. The
/// condition equates their sum with one coefficient of the second tetrahedron.
template <int Order, class Scalar>
struct SmoothnessCondition {
  static constexpr int kTerms = bernsteinCount(4, Order);
  std::array<int, 3> face{};  ///< exponents at the vertices of the shared triangle
  int target = 0;             ///< position in the second tetrahedron
  std::array<int, kTerms> sources{};
  std::array<Scalar, kTerms> factors{};
};

/// Returns the conditions of exactly one order at a shared triangle: order 0 for continuity, order
/// 1 for the first derivatives [Kalbe11, Lai07]. A spline is C^r there if the conditions of the
/// orders 0 to r hold.
/// @param apex  barycentric coordinates, in the first tetrahedron, of the second one's apex
template <int Order, int Degree, class Scalar>
std::array<SmoothnessCondition<Order, Scalar>, bernsteinCount(3, Degree - Order)>
smoothnessConditions(const SharedFace& face, const std::array<Scalar, 4>& apex) {
  static_assert(Order >= 0 && Order <= Degree);
  constexpr auto kFace = bernsteinExponents<3, Degree - Order>();
  constexpr auto kSteps = bernsteinExponents<4, Order>();
  const auto factors = bernsteinBasis<4, Order, Scalar>(apex);
  std::array<SmoothnessCondition<Order, Scalar>, bernsteinCount(3, Degree - Order)> conditions{};
  for (std::size_t n = 0; n < kFace.size(); ++n) {
    std::array<int, 4> first{}, second{};
    for (int v = 0; v < 3; ++v) {
      first[face.first[v]] = kFace[n][v];
      second[face.second[v]] = kFace[n][v];
    }
    second[face.secondApex] = Order;
    auto& condition = conditions[n];
    condition.face = kFace[n];
    condition.target = bernsteinIndex(second);
    condition.factors = factors;
    for (std::size_t s = 0; s < kSteps.size(); ++s) {
      std::array<int, 4> raised = first;
      for (int v = 0; v < 4; ++v) raised[v] += kSteps[s][v];
      condition.sources[s] = bernsteinIndex(raised);
    }
  }
  return conditions;
}

/// Returns the residuals of smoothnessConditions(): all are zero if and only if the conditions
/// hold.
template <int Order, int Degree, class Scalar>
std::array<Scalar, bernsteinCount(3, Degree - Order)> smoothnessResiduals(
    const BernsteinForm<4, Degree, Scalar>& first, const BernsteinForm<4, Degree, Scalar>& second,
    const SharedFace& face, const std::array<Scalar, 4>& apex) {
  std::array<Scalar, bernsteinCount(3, Degree - Order)> residuals{};
  const auto conditions = smoothnessConditions<Order, Degree, Scalar>(face, apex);
  for (std::size_t n = 0; n < conditions.size(); ++n) {
    residuals[n] = second.coefficients[conditions[n].target];
    for (std::size_t s = 0; s < conditions[n].sources.size(); ++s)
      residuals[n] -= conditions[n].factors[s] * first.coefficients[conditions[n].sources[s]];
  }
  return residuals;
}

}  // namespace levelset
