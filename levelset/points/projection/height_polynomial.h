#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace levelset::points {

inline constexpr int kMostDegree = 5;
inline constexpr std::size_t kMostCoefficients = (kMostDegree + 1) * (kMostDegree + 2) / 2;

/// Value and derivatives of a height function.
struct HeightJet {
  double value = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

/// Polynomial height function, in the order 1, x, y, x², xy, y², x³, ….
struct HeightPolynomial {
  int degree = 0;
  std::array<double, kMostCoefficients> coefficients{};

  [[nodiscard]] double value(double x, double y) const;
  [[nodiscard]] HeightJet jet(double x, double y) const;
};

/// Height above a position of the plane, with the weight of its square error.
struct HeightSample {
  double x, y, height, weight;
};

/// Fits a polynomial by weighted least squares. Takes the greatest degree, up to `most`, at which
/// the condition number of the normal equations is at most `condition`: the samples then lie near
/// no algebraic curve of this degree [Kalbe11]. Distances of about one between the samples are
/// assumed.
/// @return nullopt if even degree 1 exceeds the condition number
[[nodiscard]] std::optional<HeightPolynomial> fitHeights(std::span<const HeightSample> samples,
                                                         int most, double condition);

/// Fits a polynomial as above, of the degree with the least error of prediction (leave-one-out
/// cross-validation) among those allowed. Noise gets a low degree.
[[nodiscard]] std::optional<HeightPolynomial> fitHeightsByPrediction(
    std::span<const HeightSample> samples, int most, double condition);

}  // namespace levelset::points
