#pragma once

#include <array>

#include "levelset/splines/bernstein_form.h"
#include "levelset/splines/elimination.h"

namespace levelset {

/// Converts values at the domain points of a simplex to Bernstein coefficients: the polynomial of
/// the Lagrange interpolation. Values are in the order of bernsteinIndex(). Construct it once per
/// degree, since it inverts a matrix.
template <int Vertices, int Degree, class Scalar = double>
class LagrangeConversion {
 public:
  static constexpr int kCount = bernsteinCount(Vertices, Degree);

  LagrangeConversion() {
    std::array<std::array<Scalar, kCount>, kCount> basis{};
    constexpr auto kExponents = bernsteinExponents<Vertices, Degree>();
    for (int p = 0; p < kCount; ++p)
      basis[p] =
          bernsteinBasis<Vertices, Degree, Scalar>(bernsteinDomainPoint<Scalar>(kExponents[p]));
    inverse_ = inverseMatrix(basis);
  }

  [[nodiscard]] BernsteinForm<Vertices, Degree, Scalar> operator()(
      const std::array<Scalar, kCount>& values) const {
    BernsteinForm<Vertices, Degree, Scalar> form;
    for (int i = 0; i < kCount; ++i) {
      Scalar sum = inverse_[i][0] * values[0];
      for (int j = 1; j < kCount; ++j) sum += inverse_[i][j] * values[j];
      form.coefficients[i] = sum;
    }
    return form;
  }

 private:
  std::array<std::array<Scalar, kCount>, kCount> inverse_{};
};

}  // namespace levelset
