#pragma once

#include <array>
#include <cstddef>

/// Polynomials in Bernstein-Bézier form on a simplex [Kalbe11, Lai07]. Barycentric coordinates and
/// coefficients have any scalar type with exact or rounded arithmetic.
namespace levelset {

/// Returns the number of Bernstein coefficients of a degree on a simplex with `vertices` vertices;
/// 0 for a negative degree.
constexpr int bernsteinCount(int vertices, int degree) {
  if (degree < 0) return 0;
  int count = 1;
  for (int i = 1; i < vertices; ++i) count = count * (degree + i) / i;
  return count;
}

/// Returns the position of a coefficient among all of its degree. The order is lexicographic, and
/// the first exponent descends: 200, 110, 101, 020, 011, 002.
template <std::size_t Vertices>
constexpr int bernsteinIndex(const std::array<int, Vertices>& exponents) {
  int rest = 0;
  for (const int e : exponents) rest += e;
  int index = 0;
  for (std::size_t v = 0; v + 1 < Vertices; ++v) {
    rest -= exponents[v];
    index += bernsteinCount(static_cast<int>(Vertices - v), rest - 1);
  }
  return index;
}

/// Returns the exponents of all coefficients of a degree, in the order of bernsteinIndex().
template <int Vertices, int Degree>
constexpr auto bernsteinExponents() {
  std::array<std::array<int, Vertices>, bernsteinCount(Vertices, Degree)> all{};
  std::array<int, Vertices> e{};
  e[0] = Degree;
  for (std::size_t n = 0; n < all.size(); ++n) {
    all[n] = e;
    int v = Vertices - 2;
    while (v > 0 && e[v] == 0) --v;
    if (v < 0 || e[v] == 0) break;
    const int last = e[Vertices - 1];
    e[Vertices - 1] = 0;
    --e[v];
    e[v + 1] = last + 1;
  }
  return all;
}

/// Table of neighbours for the de Casteljau algorithm. The entry [m][v] is the position, in degree
/// `Degree`, of the coefficient whose exponents are those of position m in degree `Degree` − 1
/// after exponent v is raised by one.
template <int Vertices, int Degree>
inline constexpr auto kBernsteinRaise = [] {
  constexpr auto kLower = bernsteinExponents<Vertices, Degree - 1>();
  std::array<std::array<int, Vertices>, kLower.size()> table{};
  for (std::size_t m = 0; m < kLower.size(); ++m)
    for (int v = 0; v < Vertices; ++v) {
      auto e = kLower[m];
      ++e[v];
      table[m][v] = bernsteinIndex(e);
    }
  return table;
}();

/// Returns the barycentric coordinates of the domain point of a coefficient: exponents / degree.
template <class Scalar, std::size_t Vertices>
std::array<Scalar, Vertices> bernsteinDomainPoint(const std::array<int, Vertices>& exponents) {
  int degree = 0;
  for (const int e : exponents) degree += e;
  std::array<Scalar, Vertices> point;
  for (std::size_t v = 0; v < Vertices; ++v) point[v] = Scalar(exponents[v]) / Scalar(degree);
  return point;
}

/// Returns all Bernstein basis polynomials of a degree at barycentric coordinates. They sum to one
/// where the coordinates sum to one.
template <int Vertices, int Degree, class Scalar>
std::array<Scalar, bernsteinCount(Vertices, Degree)> bernsteinBasis(
    const std::array<Scalar, Vertices>& weights) {
  std::array<Scalar, bernsteinCount(Vertices, Degree)> basis{};
  if constexpr (Degree == 0) {
    basis[0] = Scalar(1);
  } else {
    basis.fill(Scalar(0));
    const auto lower = bernsteinBasis<Vertices, Degree - 1, Scalar>(weights);
    constexpr auto& kRaise = kBernsteinRaise<Vertices, Degree>;
    for (std::size_t m = 0; m < lower.size(); ++m)
      for (int v = 0; v < Vertices; ++v) basis[kRaise[m][v]] += weights[v] * lower[m];
  }
  return basis;
}

/// Polynomial of total degree at most `Degree` on a simplex with `Vertices` vertices.
template <int Vertices, int Degree, class Scalar = double>
struct BernsteinForm {
  static_assert(Vertices >= 2 && Degree >= 0);
  static constexpr int kVertices = Vertices;
  static constexpr int kDegree = Degree;
  static constexpr int kCount = bernsteinCount(Vertices, Degree);
  /// Barycentric coordinates of a point (sum 1) or of a direction (sum 0).
  using Weights = std::array<Scalar, Vertices>;
  using Exponents = std::array<int, Vertices>;

  std::array<Scalar, kCount> coefficients{};  ///< in the order of bernsteinIndex()

  [[nodiscard]] const Scalar& at(const Exponents& exponents) const {
    return coefficients[bernsteinIndex(exponents)];
  }
  [[nodiscard]] Scalar& at(const Exponents& exponents) {
    return coefficients[bernsteinIndex(exponents)];
  }

  /// One step of the de Casteljau algorithm: fixes one argument of the blossom.
  [[nodiscard]] BernsteinForm<Vertices, Degree - 1, Scalar> step(const Weights& weights) const {
    static_assert(Degree > 0);
    constexpr auto& kRaise = kBernsteinRaise<Vertices, Degree>;
    BernsteinForm<Vertices, Degree - 1, Scalar> lower;
    for (int m = 0; m < lower.kCount; ++m) {
      Scalar sum = weights[0] * coefficients[kRaise[m][0]];
      for (int v = 1; v < Vertices; ++v) sum += weights[v] * coefficients[kRaise[m][v]];
      lower.coefficients[m] = sum;
    }
    return lower;
  }

  [[nodiscard]] Scalar value(const Weights& point) const {
    if constexpr (Degree == 0)
      return coefficients[0];
    else
      return step(point).value(point);
  }

  /// Blossom (polar form): symmetric, affine in each argument, and equal to value() where all
  /// arguments are equal.
  [[nodiscard]] Scalar blossom(const std::array<Weights, Degree>& arguments) const {
    if constexpr (Degree == 0) {
      return coefficients[0];
    } else {
      std::array<Weights, Degree - 1> rest{};
      for (int i = 1; i < Degree; ++i) rest[i - 1] = arguments[i];
      return step(arguments[0]).blossom(rest);
    }
  }

  /// Derivative of value() along a direction, whose coordinates sum to 0.
  [[nodiscard]] Scalar derivative(const Weights& point, const Weights& direction) const {
    if constexpr (Degree == 0)
      return Scalar(0);
    else
      return Scalar(Degree) * step(direction).value(point);
  }

  /// Second derivative along two directions.
  [[nodiscard]] Scalar secondDerivative(const Weights& point, const Weights& first,
                                        const Weights& second) const {
    if constexpr (Degree < 2)
      return Scalar(0);
    else
      return Scalar(Degree * (Degree - 1)) * step(first).step(second).value(point);
  }

  /// Partial derivatives by the barycentric coordinates, taken as independent variables.
  /// The factor is the degree; [Kalbe11] prints the derivatives without it.
  [[nodiscard]] Weights barycentricGradient(const Weights& point) const {
    Weights gradient{};
    if constexpr (Degree == 0) {
      gradient.fill(Scalar(0));
    } else if constexpr (Degree == 1) {
      gradient = coefficients;
    } else {
      gradient = lowered<1>(point).coefficients;
      for (Scalar& g : gradient) g *= Scalar(Degree);
    }
    return gradient;
  }

  /// Second partial derivatives by the barycentric coordinates. The factor is degree · (degree −
  /// 1).
  [[nodiscard]] std::array<Weights, Vertices> barycentricHessian(const Weights& point) const {
    std::array<Weights, Vertices> hessian{};
    if constexpr (Degree < 2) {
      for (Weights& row : hessian) row.fill(Scalar(0));
    } else {
      const BernsteinForm<Vertices, 2, Scalar> quadratic = lowered<2>(point);
      for (int u = 0; u < Vertices; ++u)
        for (int v = 0; v < Vertices; ++v) {
          std::array<int, Vertices> e{};
          ++e[u];
          ++e[v];
          hessian[u][v] = Scalar(Degree * (Degree - 1)) * quadratic.at(e);
        }
    }
    return hessian;
  }

  /// Restriction to the segment from a to b: the coefficient i is the blossom with `Degree` − i
  /// times a and i times b.
  [[nodiscard]] BernsteinForm<2, Degree, Scalar> restriction(const Weights& a,
                                                             const Weights& b) const {
    BernsteinForm<2, Degree, Scalar> line;
    if constexpr (Degree == 0) {
      line.coefficients[0] = coefficients[0];
    } else {
      const auto begin = step(a).restriction(a, b);
      for (int i = 0; i < Degree; ++i) line.coefficients[i] = begin.coefficients[i];
      line.coefficients[Degree] = value(b);
    }
    return line;
  }

  /// De Casteljau steps at one point down to the degree `Lower`.
  template <int Lower>
  [[nodiscard]] BernsteinForm<Vertices, Lower, Scalar> lowered(const Weights& point) const {
    if constexpr (Lower == Degree)
      return *this;
    else
      return step(point).template lowered<Lower>(point);
  }
};

}  // namespace levelset
