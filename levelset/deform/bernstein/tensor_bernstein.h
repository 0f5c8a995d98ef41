#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

/// Trivariate polynomials in tensor-product Bernstein form on the unit cube [Farin02]. The degrees
/// are known at run time only, because lattices come from files; the forms of levelset/splines have
/// one total degree at compile time, on simplices.
namespace levelset {

/// Polynomial Σ c_ijk B_i(u) B_j(v) B_k(w) with one degree for each parameter. In the unit cube its
/// values lie between the smallest and the largest coefficient.
struct TensorBernstein {
  std::array<int, 3> degree = {0, 0, 0};
  std::vector<double> coefficients = {};  ///< (l + 1)(m + 1)(n + 1) numbers, k fastest

  TensorBernstein() = default;
  explicit TensorBernstein(const std::array<int, 3>& degrees);

  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(i) * static_cast<std::size_t>(degree[1] + 1) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(degree[2] + 1) +
           static_cast<std::size_t>(k);
  }
  [[nodiscard]] double& at(int i, int j, int k) { return coefficients[index(i, j, k)]; }
  [[nodiscard]] double at(int i, int j, int k) const { return coefficients[index(i, j, k)]; }
};

/// Bounds of the values in the unit cube: the smallest and the largest coefficient.
struct CoefficientRange {
  double least, most;
};
[[nodiscard]] CoefficientRange rangeOf(const TensorBernstein& form);
/// Largest magnitude of a coefficient.
[[nodiscard]] double largestCoefficient(const TensorBernstein& form);

/// Evaluates by the de Casteljau algorithm.
[[nodiscard]] double valueAt(const TensorBernstein& form, const std::array<double, 3>& parameter);

/// Differentiates by one parameter. The derivative of a constant is zero, of degree 0.
[[nodiscard]] TensorBernstein derivative(const TensorBernstein& form, int axis);

/// Binomial coefficients of one row of Pascal's triangle. Rounded above 2^53.
[[nodiscard]] std::vector<double> binomials(int degree);

/// Adds `factor` × `other`, which has the same degrees, to `form`.
void addTo(TensorBernstein& form, const TensorBernstein& other, double factor);

/// Multiplies two polynomials; degrees add. All weights of the products are positive, so the
/// rounding error of a coefficient is at most some units of precision of the sum of magnitudes.
[[nodiscard]] TensorBernstein product(const TensorBernstein& a, const TensorBernstein& b);

/// Number of multiplications of product().
[[nodiscard]] double productCost(const std::array<int, 3>& a, const std::array<int, 3>& b);

/// Returns a b − c d.
[[nodiscard]] TensorBernstein difference2x2(const TensorBernstein& a, const TensorBernstein& b,
                                            const TensorBernstein& c, const TensorBernstein& d);

/// Three polynomials, as the components of a vector.
using TensorVector = std::array<TensorBernstein, 3>;
/// Determinant of three columns. The components of each have the same degrees.
[[nodiscard]] TensorBernstein determinantOf(const TensorVector& a, const TensorVector& b,
                                            const TensorVector& c);

/// Number of multiplications of the determinant of the derivatives of a map with these degrees.
[[nodiscard]] double determinantCost(const std::array<int, 3>& degree);

/// Derivatives of a map by its three parameters, each with three components.
using TensorPartials = std::array<TensorVector, 3>;
/// @param map  its first three components are differentiated
template <std::size_t N>
[[nodiscard]] TensorPartials partialsOf(const std::array<TensorBernstein, N>& map) {
  static_assert(N >= 3);
  TensorPartials result;
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t c = 0; c < 3; ++c)
      result[static_cast<std::size_t>(axis)][c] = derivative(map[c], axis);
  return result;
}

/// Splits at the middle of one parameter by the de Casteljau algorithm. Each half is a polynomial
/// on the unit cube.
[[nodiscard]] std::pair<TensorBernstein, TensorBernstein> halves(const TensorBernstein& form,
                                                                 int axis);

/// Raises the degree of one parameter by one. The polynomial stays the same.
[[nodiscard]] TensorBernstein elevated(const TensorBernstein& form, int axis);

}  // namespace levelset
