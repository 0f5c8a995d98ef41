#pragma once

#include <array>
#include <cstddef>

#include "levelset/splines/elimination.h"

namespace levelset {

/// Affine map from the Cartesian coordinates of a simplex to its barycentric coordinates.
/// rows[v] holds the gradient of the coordinate v and its constant term.
template <int Vertices, class Scalar = double>
struct BarycentricMap {
  using Point = std::array<Scalar, Vertices - 1>;
  using Weights = std::array<Scalar, Vertices>;

  std::array<Weights, Vertices> rows{};

  /// Coordinates of a point. They sum to 1, and none is negative inside the simplex.
  [[nodiscard]] Weights coordinates(const Point& point) const {
    Weights weights = directional(point);
    for (int v = 0; v < Vertices; ++v) weights[v] += rows[v][Vertices - 1];
    return weights;
  }

  /// Coordinates of a direction. They sum to 0.
  [[nodiscard]] Weights directional(const Point& direction) const {
    Weights weights{};
    for (int v = 0; v < Vertices; ++v) {
      weights[v] = rows[v][0] * direction[0];
      for (int d = 1; d + 1 < Vertices; ++d) weights[v] += rows[v][d] * direction[d];
    }
    return weights;
  }

  /// Cartesian gradient from the partial derivatives by the barycentric coordinates.
  [[nodiscard]] Point gradient(const Weights& partial) const {
    Point result{};
    for (int d = 0; d + 1 < Vertices; ++d) {
      result[d] = partial[0] * rows[0][d];
      for (int v = 1; v < Vertices; ++v) result[d] += partial[v] * rows[v][d];
    }
    return result;
  }

  /// Cartesian second derivatives from those by the barycentric coordinates.
  [[nodiscard]] std::array<Point, Vertices - 1> hessian(
      const std::array<Weights, Vertices>& partial) const {
    std::array<Point, Vertices - 1> result{};
    for (int v = 0; v < Vertices; ++v) {
      const Point row = gradient(partial[v]);
      for (int d = 0; d + 1 < Vertices; ++d)
        for (int e = 0; e + 1 < Vertices; ++e) result[d][e] += rows[v][d] * row[e];
    }
    return result;
  }
};

/// Returns the map of a simplex.
/// @throws InvalidInput if its vertices lie in a plane or on a line
template <std::size_t Vertices, class Scalar, std::size_t Dimension>
BarycentricMap<static_cast<int>(Vertices), Scalar> barycentricMap(
    const std::array<std::array<Scalar, Dimension>, Vertices>& vertices) {
  static_assert(Dimension + 1 == Vertices);
  std::array<std::array<Scalar, Vertices>, Vertices> matrix{};
  for (std::size_t v = 0; v < Vertices; ++v) {
    for (std::size_t d = 0; d < Dimension; ++d) matrix[d][v] = vertices[v][d];
    matrix[Dimension][v] = Scalar(1);
  }
  return {inverseMatrix(matrix)};
}

}  // namespace levelset
