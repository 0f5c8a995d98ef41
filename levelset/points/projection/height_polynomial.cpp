#include "levelset/points/projection/height_polynomial.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>

namespace levelset::points {
namespace {

using Coefficients = std::array<double, kMostCoefficients>;

constexpr std::size_t coefficientCount(int degree) {
  return static_cast<std::size_t>((degree + 1) * (degree + 2) / 2);
}

/// Computes the monomials up to a degree.
void monomials(double x, double y, int degree, Coefficients& values) {
  values[0] = 1;
  std::size_t at = 1, before = 0;
  for (int q = 1; q <= degree; ++q) {
    const auto width = static_cast<std::size_t>(q);
    for (std::size_t i = 0; i < width; ++i) values[at + i] = values[before + i] * x;
    values[at + width] = values[before + width - 1] * y;
    before = at;
    at += width + 1;
  }
}

template <int kUnknowns>
std::optional<HeightPolynomial> solve(const Eigen::MatrixXd& all, const Eigen::VectorXd& right,
                                      int degree, double condition) {
  using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;
  const Matrix matrix = all.topLeftCorner<kUnknowns, kUnknowns>();
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(matrix);
  const auto& values = solver.eigenvalues();
  if (!(values[0] > 0 && values[kUnknowns - 1] <= condition * values[0])) return std::nullopt;
  const Vector inAxes = solver.eigenvectors().transpose() * right.head<kUnknowns>();
  const Vector solution = solver.eigenvectors() * inAxes.cwiseQuotient(values);
  HeightPolynomial result;
  result.degree = degree;
  std::copy(solution.begin(), solution.end(), result.coefficients.begin());
  return result;
}

}  // namespace

double HeightPolynomial::value(double x, double y) const {
  // Horner's scheme in both variables would need another order of the coefficients.
  double sum = coefficients[0];
  Coefficients powers;
  monomials(x, y, degree, powers);
  for (std::size_t i = 1; i < coefficientCount(degree); ++i) sum += coefficients[i] * powers[i];
  return sum;
}

HeightJet HeightPolynomial::jet(double x, double y) const {
  Coefficients powers;
  monomials(x, y, degree, powers);
  HeightJet jet;
  std::size_t at = 0;
  // Derivatives lower the degree by one or two: start of the monomials of those degrees.
  std::size_t lower = 0, lowest = 0;
  for (int q = 0; q <= degree; ++q) {
    for (int j = 0; j <= q; ++j) {
      const double c = coefficients[at + static_cast<std::size_t>(j)];
      const int i = q - j;  // x^i y^j
      const auto y0 = static_cast<std::size_t>(j), y1 = y0 - 1, y2 = y0 - 2;
      jet.value += c * powers[at + y0];
      if (i > 0) jet.x += c * i * powers[lower + y0];
      if (j > 0) jet.y += c * j * powers[lower + y1];
      if (i > 1) jet.xx += c * i * (i - 1) * powers[lowest + y0];
      if (i > 0 && j > 0) jet.xy += c * i * j * powers[lowest + y1];
      if (j > 1) jet.yy += c * j * (j - 1) * powers[lowest + y2];
    }
    lowest = lower;
    lower = at;
    at += static_cast<std::size_t>(q) + 1;
  }
  return jet;
}

namespace {

/// Normal equations of a fit.
struct NormalEquations {
  int most;  ///< degree
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;

  NormalEquations(std::span<const HeightSample> samples, int wanted) : most(wanted) {
    while (most > 1 && samples.size() < coefficientCount(most)) --most;
    const auto unknowns = static_cast<Eigen::Index>(coefficientCount(most));
    matrix = Eigen::MatrixXd::Zero(unknowns, unknowns);
    right = Eigen::VectorXd::Zero(unknowns);
    Coefficients values;
    for (const HeightSample& sample : samples) {
      monomials(sample.x, sample.y, most, values);
      const Eigen::Map<const Eigen::VectorXd> row(values.data(), unknowns);
      matrix.selfadjointView<Eigen::Lower>().rankUpdate(row, sample.weight);
      right += sample.weight * sample.height * row;
    }
  }
  [[nodiscard]] std::optional<HeightPolynomial> fit(int degree, double condition) const {
    return degree == 5   ? solve<21>(matrix, right, degree, condition)
           : degree == 4 ? solve<15>(matrix, right, degree, condition)
           : degree == 3 ? solve<10>(matrix, right, degree, condition)
           : degree == 2 ? solve<6>(matrix, right, degree, condition)
                         : solve<3>(matrix, right, degree, condition);
  }
};

}  // namespace

std::optional<HeightPolynomial> fitHeights(std::span<const HeightSample> samples, int most,
                                           double condition) {
  const NormalEquations equations(samples, most);
  for (int degree = equations.most; degree >= 1; --degree)
    if (const auto fit = equations.fit(degree, condition)) return fit;
  return std::nullopt;
}

std::optional<HeightPolynomial> fitHeightsByPrediction(std::span<const HeightSample> samples,
                                                       int most, double condition) {
  const NormalEquations equations(samples, most);
  constexpr double kLeastShare = 1e-3;
  Coefficients values;
  std::optional<HeightPolynomial> best;
  double least = std::numeric_limits<double>::infinity();
  for (int degree = 1; degree <= equations.most; ++degree) {
    const auto fit = equations.fit(degree, condition);
    if (!fit) break;
    const auto unknowns = static_cast<Eigen::Index>(coefficientCount(degree));
    const Eigen::MatrixXd block = equations.matrix.topLeftCorner(unknowns, unknowns);
    const Eigen::MatrixXd inverse = block.selfadjointView<Eigen::Lower>().ldlt().solve(
        Eigen::MatrixXd::Identity(unknowns, unknowns));
    // Error at each sample of the fit to all others.
    double error = 0;
    for (const HeightSample& sample : samples) {
      monomials(sample.x, sample.y, degree, values);
      const Eigen::Map<const Eigen::VectorXd> row(values.data(), unknowns);
      const double share = sample.weight * row.dot(inverse * row);
      const double miss =
          (sample.height - fit->value(sample.x, sample.y)) / std::max(1 - share, kLeastShare);
      error += sample.weight * miss * miss;
    }
    if (best && !(error < least)) continue;
    least = error;
    best = fit;
  }
  return best;
}

}  // namespace levelset::points
