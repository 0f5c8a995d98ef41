#include "levelset/deform/bernstein/tensor_bernstein.h"

#include <algorithm>
#include <cmath>

namespace levelset {
namespace {

/// Multiplies each coefficient by the product of its three binomials, or divides by it.
void scaleByBinomials(TensorBernstein& form, bool divides) {
  const std::vector<double> x = binomials(form.degree[0]), y = binomials(form.degree[1]),
                            z = binomials(form.degree[2]);
  std::size_t n = 0;
  for (const double a : x)
    for (const double b : y)
      for (const double c : z) {
        const double scale = a * b * c;
        double& value = form.coefficients[n++];
        value = divides ? value / scale : value * scale;
      }
}

/// Steps through the rows of coefficients along one axis.
struct CoefficientRows {
  std::size_t stride = 1, length = 1, inner = 1, outer = 1;

  CoefficientRows(const std::array<int, 3>& degree, int axis) {
    for (int other = axis + 1; other < 3; ++other)
      stride *= static_cast<std::size_t>(degree[static_cast<std::size_t>(other)] + 1);
    for (int other = 0; other < axis; ++other)
      outer *= static_cast<std::size_t>(degree[static_cast<std::size_t>(other)] + 1);
    inner = stride;
    length = static_cast<std::size_t>(degree[static_cast<std::size_t>(axis)] + 1);
  }
  template <class Visit>
  void forEach(const Visit& visit) const {
    for (std::size_t o = 0; o < outer; ++o)
      for (std::size_t i = 0; i < inner; ++i) visit(o, i);
  }
  [[nodiscard]] std::size_t begin(std::size_t o, std::size_t i) const {
    return o * length * stride + i;
  }
};

}  // namespace

std::vector<double> binomials(int degree) {
  std::vector<double> row{1};
  for (int n = 1; n <= degree; ++n) {
    row.push_back(1);
    for (int i = n - 1; i > 0; --i)
      row[static_cast<std::size_t>(i)] += row[static_cast<std::size_t>(i - 1)];
  }
  return row;
}

TensorBernstein::TensorBernstein(const std::array<int, 3>& degrees)
    : degree(degrees),
      coefficients(static_cast<std::size_t>(degrees[0] + 1) *
                       static_cast<std::size_t>(degrees[1] + 1) *
                       static_cast<std::size_t>(degrees[2] + 1),
                   0.0) {}

CoefficientRange rangeOf(const TensorBernstein& form) {
  const auto [least, most] =
      std::minmax_element(form.coefficients.begin(), form.coefficients.end());
  return {*least, *most};
}

double largestCoefficient(const TensorBernstein& form) {
  const CoefficientRange range = rangeOf(form);
  return std::max(std::abs(range.least), std::abs(range.most));
}

double valueAt(const TensorBernstein& form, const std::array<double, 3>& parameter) {
  std::vector<double> values = form.coefficients;
  std::size_t rows = values.size();
  for (int axis = 2; axis >= 0; --axis) {
    const auto length = static_cast<std::size_t>(form.degree[static_cast<std::size_t>(axis)] + 1);
    const double t = parameter[static_cast<std::size_t>(axis)];
    rows /= length;
    for (std::size_t row = 0; row < rows; ++row) {
      double* line = values.data() + row * length;
      for (std::size_t step = 1; step < length; ++step)
        for (std::size_t i = 0; i + step < length; ++i)
          line[i] = (1 - t) * line[i] + t * line[i + 1];
      values[row] = line[0];
    }
  }
  return values[0];
}

TensorBernstein derivative(const TensorBernstein& form, int axis) {
  const int degree = form.degree[static_cast<std::size_t>(axis)];
  if (degree == 0) return TensorBernstein({0, 0, 0});
  std::array<int, 3> lower = form.degree;
  --lower[static_cast<std::size_t>(axis)];
  TensorBernstein result(lower);
  const CoefficientRows from(form.degree, axis), to(lower, axis);
  from.forEach([&](std::size_t o, std::size_t i) {
    const std::size_t a = from.begin(o, i), b = to.begin(o, i);
    for (std::size_t n = 0; n < to.length; ++n)
      result.coefficients[b + n * to.stride] =
          degree *
          (form.coefficients[a + (n + 1) * from.stride] - form.coefficients[a + n * from.stride]);
  });
  return result;
}

void addTo(TensorBernstein& form, const TensorBernstein& other, double factor) {
  for (std::size_t n = 0; n < form.coefficients.size(); ++n)
    form.coefficients[n] += factor * other.coefficients[n];
}

TensorBernstein product(const TensorBernstein& a, const TensorBernstein& b) {
  TensorBernstein left = a, right = b;
  scaleByBinomials(left, false);
  scaleByBinomials(right, false);
  TensorBernstein result(
      {a.degree[0] + b.degree[0], a.degree[1] + b.degree[1], a.degree[2] + b.degree[2]});
  for (int i = 0; i <= a.degree[0]; ++i)
    for (int j = 0; j <= a.degree[1]; ++j)
      for (int k = 0; k <= a.degree[2]; ++k) {
        const double factor = left.at(i, j, k);
        if (factor == 0) continue;
        for (int p = 0; p <= b.degree[0]; ++p)
          for (int q = 0; q <= b.degree[1]; ++q) {
            const double* from = right.coefficients.data() + right.index(p, q, 0);
            double* to = result.coefficients.data() + result.index(i + p, j + q, k);
            for (int r = 0; r <= b.degree[2]; ++r) to[r] += factor * from[r];
          }
      }
  scaleByBinomials(result, true);
  return result;
}

double productCost(const std::array<int, 3>& a, const std::array<int, 3>& b) {
  double cost = 1;
  for (std::size_t axis = 0; axis < 3; ++axis)
    cost *= static_cast<double>(a[axis] + 1) * static_cast<double>(b[axis] + 1);
  return cost;
}

TensorBernstein difference2x2(const TensorBernstein& a, const TensorBernstein& b,
                              const TensorBernstein& c, const TensorBernstein& d) {
  TensorBernstein result = product(a, b);
  addTo(result, product(c, d), -1);
  return result;
}

double determinantCost(const std::array<int, 3>& degree) {
  const std::array<int, 3> twice = {2 * degree[0], 2 * degree[1], 2 * degree[2]};
  return 6 * productCost(degree, degree) + 3 * productCost(degree, twice);
}

TensorBernstein determinantOf(const TensorVector& a, const TensorVector& b, const TensorVector& c) {
  TensorBernstein result;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const TensorBernstein term = product(a[i], difference2x2(b[j], c[k], b[k], c[j]));
    if (i == 0)
      result = term;
    else
      addTo(result, term, 1);
  }
  return result;
}

std::pair<TensorBernstein, TensorBernstein> halves(const TensorBernstein& form, int axis) {
  std::pair<TensorBernstein, TensorBernstein> result{form, form};
  const CoefficientRows rows(form.degree, axis);
  rows.forEach([&](std::size_t o, std::size_t i) {
    const std::size_t begin = rows.begin(o, i);
    double* left = result.first.coefficients.data() + begin;
    double* right = result.second.coefficients.data() + begin;
    const std::size_t s = rows.stride, last = rows.length - 1;
    // `right` holds the current step; its first number is the next one of `left`.
    for (std::size_t step = 1; step <= last; ++step) {
      for (std::size_t n = 0; n + step <= last; ++n)
        right[n * s] = 0.5 * (right[n * s] + right[(n + 1) * s]);
      left[step * s] = right[0];
    }
  });
  return result;
}

TensorBernstein elevated(const TensorBernstein& form, int axis) {
  std::array<int, 3> higher = form.degree;
  const int degree = ++higher[static_cast<std::size_t>(axis)];
  TensorBernstein result(higher);
  const CoefficientRows from(form.degree, axis), to(higher, axis);
  from.forEach([&](std::size_t o, std::size_t i) {
    const std::size_t a = from.begin(o, i), b = to.begin(o, i);
    for (std::size_t n = 0; n <= from.length; ++n) {
      const double share = static_cast<double>(n) / degree;
      double value = 0;
      if (n > 0) value += share * form.coefficients[a + (n - 1) * from.stride];
      if (n < from.length) value += (1 - share) * form.coefficients[a + n * from.stride];
      result.coefficients[b + n * to.stride] = value;
    }
  });
  return result;
}

}  // namespace levelset
