// Signs of determinants beside arithmetic with long integers.

#include "levelset/geometry/exact_predicates.h"

#include <gtest/gtest.h>

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>

namespace exact_predicates_test {

using Imath::V2d;
using Imath::V3d;
using Integer = boost::multiprecision::cpp_int;

Integer integer(double value) {
  return Integer(static_cast<long long>(value));
}

int signOf(const Integer& value) {
  return value > 0 ? 1 : value < 0 ? -1 : 0;
}

int exactOrient2d(const V2d& a, const V2d& b, const V2d& c) {
  return signOf((integer(a.x) - integer(c.x)) * (integer(b.y) - integer(c.y)) -
                (integer(a.y) - integer(c.y)) * (integer(b.x) - integer(c.x)));
}

int exactOrient3d(const V3d& a, const V3d& b, const V3d& c, const V3d& d) {
  std::array<std::array<Integer, 3>, 3> m;
  const std::array<V3d, 3> rows = {b, c, d};
  for (std::size_t i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      m[i][static_cast<std::size_t>(k)] = integer(rows[i][k]) - integer(a[k]);
  return signOf(Integer((m[0][1] * m[1][2] - m[0][2] * m[1][1]) * m[2][0] +
                        (m[0][2] * m[1][0] - m[0][0] * m[1][2]) * m[2][1] +
                        (m[0][0] * m[1][1] - m[0][1] * m[1][0]) * m[2][2]));
}

/// Whole numbers below 2^4, or for one in four below 2^53. The difference of two large ones may be
/// inexact.
class Numbers {
 public:
  double operator()() {
    const int bits = std::uniform_int_distribution(0, 3)(random_) == 0 ? 53 : 4;
    const double limit = std::ldexp(1, bits);
    return std::floor(std::uniform_real_distribution(-limit, limit)(random_));
  }
  int sign() { return std::uniform_int_distribution(-1, 1)(random_); }

 private:
  std::mt19937 random_{7};
};

TEST(ExactPredicates, GiveTheSidesOfLines) {
  Numbers number;
  std::array<int, 3> counts{};
  for (int k = 0; k < 30000; ++k) {
    V2d a(number(), number()), b(number(), number()), c(number(), number());
    if (k % 3 == 0) c = (a + b) / 2;  // near the line
    if (k % 3 == 0) c = V2d(std::floor(c.x), std::floor(c.y));
    if (k % 5 == 0) a.y = b.y = c.y;
    if (k % 7 == 0) b = a;
    const int expected = exactOrient2d(a, b, c);
    ASSERT_EQ(levelset::convert::orient2d(a, b, c), expected) << a << b << c;
    ++counts[static_cast<std::size_t>(expected + 1)];
  }
  for (const int count : counts) EXPECT_GT(count, 3000);
}

TEST(ExactPredicates, GiveTheSidesOfPlanes) {
  Numbers number;
  std::array<int, 3> counts{};
  for (int k = 0; k < 30000; ++k) {
    V3d a(number(), number(), number()), b(number(), number(), number()),
        c(number(), number(), number()), d(number(), number(), number());
    if (k % 3 == 0) d = b + (c - a);  // the fourth corner of a parallelogram, but for rounding
    if (k % 4 == 0) d[k % 3] += number.sign();
    if (k % 5 == 0) a[k % 3] = b[k % 3] = c[k % 3] = d[k % 3];
    const int expected = exactOrient3d(a, b, c, d);
    ASSERT_EQ(levelset::convert::orient3d(a, b, c, d), expected) << a << b << c << d;
    ++counts[static_cast<std::size_t>(expected + 1)];
  }
  for (const int count : counts) EXPECT_GT(count, 3000);
}

}  // namespace exact_predicates_test
