#include "levelset/segmented/local/interface_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace levelset {
namespace {

using Imath::V3d;

constexpr std::size_t kFitTerms = InterfaceFit::kTerms;
constexpr double kFitFlattest = 0.01;  // least squared slope of a distance
constexpr double kFitSpread = 1.4;     // voxels: standard deviation of the weights of samples
constexpr double kFitFlatness = 1e-3;  // prefers planes where samples do not determine curvature
constexpr double kFitFirstFlatness = 0.1;
constexpr double kFitDamping = 1e-3;    // of steps along the curve, where the point is free
constexpr double kFitParallel = 0.02;   // least area of the parallelogram of two normals, squared
constexpr double kFitAgreement = 0.05;  // voxels: residual that halves the weight of a sample
constexpr double kFitLooseAgreement = 0.25, kFitMedians = 1.5;
constexpr double kFitLeastAgreement = 0.5;  // of the weights of a fit

std::array<double, kFitTerms> fitTermsAt(const V3d& p) {
  return {1, p.x, p.y, p.z, p.x * p.x, p.y * p.y, p.z * p.z, p.y * p.z, p.z * p.x, p.x * p.y};
}

double fitDot(const std::array<double, kFitTerms>& a, const std::array<double, kFitTerms>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < kFitTerms; ++i) sum += a[i] * b[i];
  return sum;
}

/// Solves a symmetric positive definite system in place by Cholesky's method. Only the lower
/// triangle is read.
/// @return false when the matrix is singular
template <std::size_t n>
bool solveFit(std::array<std::array<double, n>, n>& a, std::array<double, n>& b) {
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t k = 0; k < j; ++k)
      for (std::size_t i = j; i < n; ++i) a[i][j] -= a[i][k] * a[j][k];
    if (!(a[j][j] > 1e-14)) return false;
    const double root = std::sqrt(a[j][j]);
    for (std::size_t i = j; i < n; ++i) a[i][j] /= root;
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
  return true;
}

/// Distance of a grid point from an interface.
struct KnownDistance {
  std::array<double, kFitTerms> terms;
  double value, weight;
};

/// Residual that halves the weight of a sample: a multiple of the median, so that noise of labels
/// does not spoil a fit, within limits.
double agreementOf(const std::vector<KnownDistance>& known, const InterfaceFit& fit) {
  std::vector<double> residuals;
  for (const KnownDistance& sample : known)
    residuals.push_back(std::abs(fitDot(fit.c, sample.terms) - sample.value));
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  return std::clamp(kFitMedians * *middle, kFitAgreement, kFitLooseAgreement);
}

}  // namespace

double InterfaceFit::value(const V3d& p) const {
  return fitDot(c, fitTermsAt(p - about));
}

V3d InterfaceFit::gradient(const V3d& p) const {
  const V3d q = p - about;
  return {c[1] + 2 * c[4] * q.x + c[8] * q.z + c[9] * q.y,
          c[2] + 2 * c[5] * q.y + c[7] * q.z + c[9] * q.x,
          c[3] + 2 * c[6] * q.z + c[7] * q.y + c[8] * q.x};
}

std::optional<InterfaceFit> fitInterface(const V3d& about,
                                         std::span<const InterfaceSample> samples) {
  if (samples.size() < kFewestSamples) return std::nullopt;
  std::vector<KnownDistance> known;
  for (const InterfaceSample& sample : samples) {
    const V3d p = sample.position - about;
    known.push_back(
        {fitTermsAt(p), sample.distance, std::exp(-p.length2() / (2 * kFitSpread * kFitSpread))});
  }
  InterfaceFit result{about, {}};
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    std::array<std::array<double, kFitTerms>, kFitTerms> matrix{};
    std::array<double, kFitTerms> right{};
    const double agreement = round == 0 ? kFitAgreement : agreementOf(known, result);
    double all = 0, agreeing = 0;
    for (const KnownDistance& sample : known) {
      double weight = sample.weight;
      if (round == 0) {
        weight *= weight * weight;  // only those nearby, which hardly lie beyond a crease
      } else {
        const double residual = (fitDot(result.c, sample.terms) - sample.value) / agreement;
        weight /= 1 + residual * residual;
        all += sample.weight;
        agreeing += weight;
      }
      for (std::size_t i = 0; i < kFitTerms; ++i) {
        const double scaled = weight * sample.terms[i];
        for (std::size_t j = 0; j <= i; ++j) matrix[i][j] += scaled * sample.terms[j];
        right[i] += scaled * sample.value;
      }
    }
    if (round + 1 == kRounds && agreeing < kFitLeastAgreement * all) return std::nullopt;
    for (std::size_t i = 0; i < kFitTerms; ++i)
      matrix[i][i] += i < 4 ? 1e-9 : round == 0 ? kFitFirstFlatness : kFitFlatness;
    if (!solveFit(matrix, right)) return std::nullopt;
    result.c = right;
  }
  return result;
}

std::optional<V3d> meetingPoint(std::span<const InterfaceFit> interfaces, const V3d& start,
                                const MeetingLimits& limits) {
  V3d at = start;
  constexpr int kSteps = 4;
  for (int step = 0; step < kSteps; ++step) {
    std::array<std::array<double, 3>, 3> matrix{};
    std::array<double, 3> right{};
    for (const InterfaceFit& interface : interfaces) {
      const double value = interface.value(at);
      const V3d gradient = interface.gradient(at);
      const double length2 = gradient.length2();
      if (!(length2 > kFitFlattest)) return std::nullopt;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
          matrix[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] +=
              gradient[i] * gradient[j] / length2;
        right[static_cast<std::size_t>(i)] -= gradient[i] * value / length2;
      }
    }
    // Sum of the principal minors of second order: zero if all normals are parallel.
    const double minors = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0] +
                          matrix[1][1] * matrix[2][2] - matrix[1][2] * matrix[2][1] +
                          matrix[2][2] * matrix[0][0] - matrix[2][0] * matrix[0][2];
    if (interfaces.size() > 1 && minors < kFitParallel) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) matrix[i][i] += kFitDamping;
    if (!solveFit(matrix, right)) return std::nullopt;
    at += V3d(right[0], right[1], right[2]);
    if (!((at - interfaces.front().about).length() <= limits.farthest)) return std::nullopt;
  }
  // Interfaces that bend sharply, as those of smoothed labels do, are not known where they meet.
  for (const InterfaceFit& interface : interfaces)
    if (std::abs(interface.value(at)) > limits.miss * interface.gradient(at).length())
      return std::nullopt;
  return at;
}

}  // namespace levelset
