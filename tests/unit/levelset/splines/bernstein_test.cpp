#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "levelset/error.h"
#include "levelset/splines/bernstein_tetrahedron.h"
#include "levelset/splines/bernstein_triangle.h"
#include "levelset/splines/lagrange_form.h"
#include "tests/support/rational.h"

namespace bernstein_test {

using namespace levelset;
using support::Rational;

template <int Vertices, int Degree>
BernsteinForm<Vertices, Degree, Rational> randomForm(int seed) {
  BernsteinForm<Vertices, Degree, Rational> form;
  for (int n = 0; n < form.kCount; ++n)
    form.coefficients[n] = Rational(support::randomWhole(seed, n)) / 7;
  return form;
}

/// Factorial formula of the basis polynomials, independent of the de Casteljau algorithm.
template <std::size_t Vertices>
Rational basisByFactorials(const std::array<int, Vertices>& exponents,
                           const std::array<Rational, Vertices>& weights) {
  const auto factorial = [](int n) {
    Rational result = 1;
    for (int i = 2; i <= n; ++i) result *= i;
    return result;
  };
  int degree = 0;
  Rational value = 1;
  for (std::size_t v = 0; v < Vertices; ++v) {
    degree += exponents[v];
    value /= factorial(exponents[v]);
    for (int n = 0; n < exponents[v]; ++n) value *= weights[v];
  }
  return value * factorial(degree);
}

template <int Vertices, int Degree>
void expectForm() {
  SCOPED_TRACE(testing::Message() << Vertices << " vertices, degree " << Degree);
  const auto form = randomForm<Vertices, Degree>(1);
  const auto p = support::randomWeights<Rational, Vertices>(2, 1);
  const auto q = support::randomWeights<Rational, Vertices>(3, 1);
  const auto u = support::randomWeights<Rational, Vertices>(4, 0);
  const auto w = support::randomWeights<Rational, Vertices>(5, 0);
  constexpr auto kExponents = bernsteinExponents<Vertices, Degree>();

  // The order of the coefficients, and the value by the basis.
  const auto basis = bernsteinBasis<Vertices, Degree, Rational>(p);
  Rational sum = 0, value = 0;
  for (int n = 0; n < form.kCount; ++n) {
    EXPECT_EQ(bernsteinIndex(kExponents[n]), n);
    if (n > 0) {
      EXPECT_GT(kExponents[n - 1], kExponents[n]);
    }
    EXPECT_EQ(basis[n], basisByFactorials(kExponents[n], p));
    sum += basis[n];
    value += basis[n] * form.coefficients[n];
  }
  EXPECT_EQ(sum, 1);
  EXPECT_EQ(form.value(p), value);

  // Coefficients are blossoms of the vertices.
  for (int n = 0; n < form.kCount; ++n) {
    std::array<std::array<Rational, Vertices>, Degree> arguments{};
    int next = 0;
    for (int v = 0; v < Vertices; ++v)
      for (int e = 0; e < kExponents[n][v]; ++e) arguments[next++][v] = 1;
    EXPECT_EQ(form.blossom(arguments), form.coefficients[n]);
  }

  // The blossom: its diagonal, symmetry, and affinity in each argument.
  std::array<std::array<Rational, Vertices>, Degree> diagonal, mixed;
  diagonal.fill(p);
  for (int i = 0; i < Degree; ++i) mixed[i] = support::randomWeights<Rational, Vertices>(10 + i, 1);
  EXPECT_EQ(form.blossom(diagonal), form.value(p));
  auto permuted = mixed;
  std::sort(permuted.begin(), permuted.end());
  do EXPECT_EQ(form.blossom(permuted), form.blossom(mixed));
  while (std::next_permutation(permuted.begin(), permuted.end()));
  const Rational t = Rational(3) / 11;
  for (int i = 0; i < Degree; ++i) {
    auto atP = mixed, atQ = mixed, between = mixed;
    atP[i] = p;
    atQ[i] = q;
    for (int v = 0; v < Vertices; ++v) between[i][v] = (1 - t) * p[v] + t * q[v];
    EXPECT_EQ(form.blossom(between), (1 - t) * form.blossom(atP) + t * form.blossom(atQ));
  }

  // The restriction to a line and its monomial coefficients.
  const auto line = form.restriction(p, q);
  const auto monomials = monomialCoefficients(line);
  const auto valueAt = [&](const Rational& s) {
    auto point = p;
    for (int v = 0; v < Vertices; ++v) point[v] += s * (q[v] - p[v]);
    return form.value(point);
  };
  for (int n = -2; n <= 8; ++n) {
    const Rational s = Rational(n) / 5;
    Rational power = 1, polynomial = 0;
    for (const Rational& c : monomials) {
      polynomial += c * power;
      power *= s;
    }
    EXPECT_EQ(lineValue(line, s), valueAt(s));
    EXPECT_EQ(polynomial, valueAt(s));
  }

  // Derivatives against the restriction to a line: its linear and its quadratic term.
  const auto along = [&](const std::array<Rational, Vertices>& direction) {
    auto end = p;
    for (int v = 0; v < Vertices; ++v) end[v] += direction[v];
    return monomialCoefficients(form.restriction(p, end));
  };
  const auto gradient = form.barycentricGradient(p);
  const auto hessian = form.barycentricHessian(p);
  Rational first = 0, second = 0;
  for (int v = 0; v < Vertices; ++v) {
    first += gradient[v] * u[v];
    for (int n = 0; n < Vertices; ++n) second += hessian[v][n] * u[v] * w[n];
  }
  EXPECT_EQ(form.derivative(p, u), Degree > 0 ? along(u)[Degree > 0 ? 1 : 0] : Rational(0));
  EXPECT_EQ(form.derivative(p, u), first);
  EXPECT_EQ(form.secondDerivative(p, u, w), second);
  if constexpr (Degree >= 2) {
    auto both = u;
    for (int v = 0; v < Vertices; ++v) both[v] += w[v];
    EXPECT_EQ(form.secondDerivative(p, u, u), 2 * along(u)[2]);
    EXPECT_EQ(form.secondDerivative(p, u, w), along(both)[2] - along(u)[2] - along(w)[2]);
  }

  // The Lagrange interpolation gives the polynomial back.
  if constexpr (Degree >= 1) {
    std::array<Rational, form.kCount> values;
    for (int n = 0; n < form.kCount; ++n)
      values[n] = form.value(bernsteinDomainPoint<Rational>(kExponents[n]));
    EXPECT_EQ((LagrangeConversion<Vertices, Degree, Rational>()(values).coefficients),
              form.coefficients);
  }
}

TEST(Bernstein, HoldsOnLines) {
  expectForm<2, 0>();
  expectForm<2, 1>();
  expectForm<2, 2>();
  expectForm<2, 3>();
  expectForm<2, 5>();
}

TEST(Bernstein, HoldsOnTriangles) {
  expectForm<3, 0>();
  expectForm<3, 1>();
  expectForm<3, 2>();
  expectForm<3, 3>();
  expectForm<3, 4>();
}

TEST(Bernstein, HoldsOnTetrahedra) {
  expectForm<4, 0>();
  expectForm<4, 1>();
  expectForm<4, 2>();
  expectForm<4, 3>();
  expectForm<4, 4>();
}

TEST(Bernstein, CountsAndOrdersCoefficients) {
  EXPECT_EQ(bernsteinCount(4, 2), 10);
  EXPECT_EQ(bernsteinCount(4, 3), 20);
  EXPECT_EQ(bernsteinCount(3, 3), 10);
  EXPECT_EQ(bernsteinCount(2, 3), 4);
  const auto exponents = bernsteinExponents<3, 3>();
  const std::array<std::array<int, 3>, 10> listed = {{{3, 0, 0},
                                                      {2, 1, 0},
                                                      {2, 0, 1},
                                                      {1, 2, 0},
                                                      {1, 1, 1},
                                                      {1, 0, 2},
                                                      {0, 3, 0},
                                                      {0, 2, 1},
                                                      {0, 1, 2},
                                                      {0, 0, 3}}};
  EXPECT_EQ(exponents, listed);
}

TEST(Bernstein, HasCartesianDerivatives) {
  // p = x² y + 3 y z − 2 z³ + x on a skew tetrahedron, by its values at the domain points.
  const auto p = [](const std::array<Rational, 3>& x) {
    return x[0] * x[0] * x[1] + 3 * x[1] * x[2] - 2 * x[2] * x[2] * x[2] + x[0];
  };
  const std::array<std::array<Rational, 3>, 4> vertices = {
      {{0, 1, 2}, {3, 0, 1}, {-1, 4, 1}, {1, 1, 5}}};
  const BarycentricMap<4, Rational> map = barycentricMap(vertices);
  std::array<Rational, 20> values;
  const auto exponents = bernsteinExponents<4, 3>();
  for (int n = 0; n < 20; ++n) {
    const auto weights = bernsteinDomainPoint<Rational>(exponents[n]);
    std::array<Rational, 3> x{};
    for (int v = 0; v < 4; ++v)
      for (int d = 0; d < 3; ++d) x[d] += weights[v] * vertices[v][d];
    EXPECT_EQ(map.coordinates(x), weights);
    values[n] = p(x);
  }
  const auto form = LagrangeConversion<4, 3, Rational>()(values);
  const std::array<Rational, 3> x = {Rational(1) / 3, Rational(2), Rational(5) / 7};
  const auto weights = map.coordinates(x);
  EXPECT_EQ(form.value(weights), p(x));
  EXPECT_EQ(gradientAt(form, map, weights),
            (std::array<Rational, 3>{2 * x[0] * x[1] + 1, x[0] * x[0] + 3 * x[2],
                                     3 * x[1] - 6 * x[2] * x[2]}));
  const std::array<std::array<Rational, 3>, 3> second = {
      {{2 * x[1], 2 * x[0], 0}, {2 * x[0], 0, 3}, {0, 3, -12 * x[2]}}};
  EXPECT_EQ(hessianAt(form, map, weights), second);
  const std::array<Rational, 3> end = {2, -1, 4};
  const auto line = restrictToSegment(form, map, x, end);
  EXPECT_EQ(line.coefficients.front(), p(x));
  EXPECT_EQ(line.coefficients.back(), p(end));

  // x² + 3 x y on a triangle of the plane.
  const auto q = [](const std::array<Rational, 2>& y) {
    return Rational(y[0] * y[0] + 3 * y[0] * y[1]);
  };
  const std::array<std::array<Rational, 2>, 3> corners = {{{0, 1}, {4, 0}, {1, 3}}};
  const BarycentricMap<3, Rational> plane = barycentricMap(corners);
  std::array<Rational, 6> planeValues;
  for (int n = 0; n < 6; ++n) {
    const auto b = bernsteinDomainPoint<Rational>(bernsteinExponents<3, 2>()[n]);
    std::array<Rational, 2> y{};
    for (int v = 0; v < 3; ++v)
      for (int d = 0; d < 2; ++d) y[d] += b[v] * corners[v][d];
    planeValues[n] = q(y);
  }
  const auto flat = LagrangeConversion<3, 2, Rational>()(planeValues);
  const std::array<Rational, 2> y = {2, Rational(1) / 3};
  const auto b = plane.coordinates(y);
  EXPECT_EQ(flat.value(b), q(y));
  EXPECT_EQ(gradientAt(flat, plane, b), (std::array<Rational, 2>{2 * y[0] + 3 * y[1], 3 * y[0]}));
  const std::array<std::array<Rational, 2>, 2> flatSecond = {{{2, 3}, {3, 0}}};
  EXPECT_EQ(hessianAt(flat, plane, b), flatSecond);
}

TEST(Bernstein, HasSlopesAtTheEndsOfALine) {
  const BernsteinLine<3, Rational> line{{Rational(2), Rational(5), Rational(-1), Rational(4)}};
  EXPECT_EQ(lineValue(line, Rational(0)), 2);
  EXPECT_EQ(lineValue(line, Rational(1)), 4);
  EXPECT_EQ(lineDerivative(line, Rational(0)), 3 * (5 - 2));
  EXPECT_EQ(lineDerivative(line, Rational(1)), 3 * (4 + 1));
}

TEST(Bernstein, RefusesFlatSimplices) {
  const std::array<std::array<double, 3>, 4> flat = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}};
  EXPECT_THROW((void)barycentricMap(flat), InvalidInput);
}

}  // namespace bernstein_test
