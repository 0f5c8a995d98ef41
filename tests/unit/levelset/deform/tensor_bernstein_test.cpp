#include "levelset/deform/bernstein/tensor_bernstein.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tensor_bernstein_test {

using namespace levelset;

TensorBernstein randomForm(const std::array<int, 3>& degree, unsigned seed) {
  TensorBernstein form(degree);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  for (double& c : form.coefficients) c = number(random);
  return form;
}

const std::array<double, 3> kAt = {0.3, 0.65, 0.9};

TEST(TensorBernstein, ProductIsThatOfTheValues) {
  for (const int degree : {1, 3, 8, 20}) {
    const TensorBernstein a = randomForm({degree, 2, 1}, 1), b = randomForm({2, degree, 3}, 2),
                          ab = product(a, b);
    EXPECT_EQ(ab.degree, (std::array<int, 3>{degree + 2, degree + 2, 4}));
    EXPECT_NEAR(valueAt(ab, kAt), valueAt(a, kAt) * valueAt(b, kAt), 1e-15) << degree;
  }
}

TEST(TensorBernstein, HalvesAndElevationKeepThePolynomial) {
  const TensorBernstein form = randomForm({4, 5, 3}, 3);
  const double value = valueAt(form, kAt);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    EXPECT_NEAR(valueAt(elevated(form, axis), kAt), value, 1e-15);
    const auto [low, high] = halves(form, axis);
    std::array<double, 3> inside = kAt;
    inside[a] = kAt[a] < 0.5 ? 2 * kAt[a] : 2 * kAt[a] - 1;
    EXPECT_NEAR(valueAt(kAt[a] < 0.5 ? low : high, inside), value, 1e-15);
    // The hull of a half lies in the hull of the whole.
    EXPECT_GE(rangeOf(low).least, rangeOf(form).least);
    EXPECT_LE(rangeOf(high).most, rangeOf(form).most);
  }
}

TEST(TensorBernstein, DerivativeIsThatOfDifferences) {
  const TensorBernstein form = randomForm({3, 4, 2}, 4);
  for (int axis = 0; axis < 3; ++axis) {
    std::array<double, 3> before = kAt, after = kAt;
    before[static_cast<std::size_t>(axis)] -= 1e-5;
    after[static_cast<std::size_t>(axis)] += 1e-5;
    const double difference = (valueAt(form, after) - valueAt(form, before)) / 2e-5;
    EXPECT_NEAR(valueAt(derivative(form, axis), kAt), difference, 3e-10);
  }
  EXPECT_EQ(valueAt(derivative(randomForm({0, 1, 1}, 5), 0), kAt), 0);
}

}  // namespace tensor_bernstein_test
