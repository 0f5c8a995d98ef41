#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

#include "levelset/error.h"

/// Gaussian elimination for small matrices of any scalar type.
namespace levelset {

/// Inverts a matrix with partial pivoting.
/// @throws InvalidInput if it is singular
template <std::size_t Size, class Scalar>
std::array<std::array<Scalar, Size>, Size> inverseMatrix(
    std::array<std::array<Scalar, Size>, Size> matrix) {
  std::array<std::array<Scalar, Size>, Size> inverse{};
  for (std::size_t i = 0; i < Size; ++i)
    for (std::size_t j = 0; j < Size; ++j) inverse[i][j] = Scalar(i == j ? 1 : 0);
  const auto magnitude = [](const Scalar& x) { return x < Scalar(0) ? Scalar(-x) : x; };
  for (std::size_t c = 0; c < Size; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < Size; ++r)
      if (magnitude(matrix[pivot][c]) < magnitude(matrix[r][c])) pivot = r;
    if (matrix[pivot][c] == Scalar(0)) throw InvalidInput("the vertices of a simplex are flat");
    std::swap(matrix[c], matrix[pivot]);
    std::swap(inverse[c], inverse[pivot]);
    const Scalar scale = Scalar(1) / matrix[c][c];
    for (std::size_t j = 0; j < Size; ++j) {
      matrix[c][j] *= scale;
      inverse[c][j] *= scale;
    }
    for (std::size_t r = 0; r < Size; ++r) {
      const Scalar factor = matrix[r][c];
      if (r == c || factor == Scalar(0)) continue;
      for (std::size_t j = 0; j < Size; ++j) {
        matrix[r][j] -= factor * matrix[c][j];
        inverse[r][j] -= factor * inverse[c][j];
      }
    }
  }
  return inverse;
}

/// Returns the rank of the rows, which have equal lengths. Exact for exact scalars. For
/// floating-point scalars a pivot below 1e-10 times the largest entry counts as zero.
template <class Scalar>
int rankOf(std::vector<std::vector<Scalar>> rows) {
  if (rows.empty()) return 0;
  const auto magnitude = [](const Scalar& x) { return x < Scalar(0) ? Scalar(-x) : x; };
  Scalar zero(0);
  if constexpr (std::is_floating_point_v<Scalar>)
    for (const auto& row : rows)
      for (const Scalar& x : row) zero = std::max(zero, Scalar(1e-10) * magnitude(x));
  std::size_t rank = 0;
  for (std::size_t c = 0; c < rows[0].size() && rank < rows.size(); ++c) {
    std::size_t pivot = rank;
    for (std::size_t r = rank + 1; r < rows.size(); ++r)
      if (magnitude(rows[pivot][c]) < magnitude(rows[r][c])) pivot = r;
    if (!(zero < magnitude(rows[pivot][c]))) continue;
    std::swap(rows[rank], rows[pivot]);
    for (std::size_t r = rank + 1; r < rows.size(); ++r) {
      if (rows[r][c] == Scalar(0)) continue;
      const Scalar factor = rows[r][c] / rows[rank][c];
      for (std::size_t j = c; j < rows[r].size(); ++j)
        if (!(rows[rank][j] == Scalar(0))) rows[r][j] -= factor * rows[rank][j];
    }
    ++rank;
  }
  return static_cast<int>(rank);
}

}  // namespace levelset
