#include "levelset/deform/untangle/untangle_solver.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"

namespace levelset::untangle {
namespace {

using Imath::V3d;

/// Certificates before the search gives up, steps of the sequence of quadratic programs in each,
/// and sweeps over the constraints of one program.
constexpr std::size_t kUntangleRounds = 12;
constexpr int kUntangleSteps = 60, kUntangleSweeps = 200;
/// Constraints are active below this multiple of the least Jacobian.
constexpr double kActive = 3;
/// Longest move of a control point in one step, over the mean distance of the control points.
constexpr double kUntangleStep = 0.25;
constexpr int kHomotopyHalvings = 10;
/// Distance over the diagonal within which a control point has not moved.
constexpr double kUnmoved = 1e-9;

double controlDiagonal(const std::vector<V3d>& points) {
  Imath::Box3d box;
  for (const V3d& p : points) box.extendBy(p);
  return box.isEmpty() ? 0 : box.size().length();
}

std::vector<DeterminantSlope> determinantsAt(const ControlledMap& map,
                                             const std::vector<V3d>& points,
                                             std::size_t maxMemory) {
  // Lists grow by doubling.
  requireMemory(2.0 * static_cast<double>(points.size()) *
                    static_cast<double>(map.slopesPerPoint()) *
                    sizeof(std::pair<std::uint32_t, V3d>),
                maxMemory);
  std::vector<DeterminantSlope> all(points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, all.size(), 4), [&](const auto& range) {
    for (std::size_t n = range.begin(); n != range.end(); ++n)
      all[n] = map.determinantAt(points[n]);
  });
  return all;
}

/// Least-norm change of `wanted` that satisfies the linearised constraints value + slope · (p − at)
/// ≥ least, by cyclic projections with multipliers.
std::vector<V3d> leastChange(const std::vector<DeterminantSlope>& constraints, double least,
                             const std::vector<V3d>& wanted, const std::vector<V3d>& at) {
  std::vector<V3d> p = wanted;
  std::vector<double> multipliers(constraints.size(), 0), norms(constraints.size(), 0);
  for (std::size_t k = 0; k < constraints.size(); ++k)
    for (const auto& [n, slope] : constraints[k].slopes) norms[k] += slope.length2();
  for (int sweep = 0; sweep < kUntangleSweeps; ++sweep) {
    double worst = 0;
    for (std::size_t k = 0; k < constraints.size(); ++k) {
      if (!(norms[k] > 0)) continue;
      double value = constraints[k].value;
      for (const auto& [n, slope] : constraints[k].slopes) value += slope.dot(p[n] - at[n]);
      const double next = std::max(0.0, multipliers[k] + (least - value) / norms[k]);
      const double change = next - multipliers[k];
      if (change == 0) continue;
      multipliers[k] = next;
      for (const auto& [n, slope] : constraints[k].slopes) p[n] += slope * change;
      worst = std::max(worst, std::abs(change) * norms[k]);
    }
    if (worst < 1e-4 * least) break;
  }
  return p;
}

/// Minimises the squared distance from `wanted` subject to the least Jacobian at the points.
void approach(ControlledMap& map, const std::vector<V3d>& points, double least,
              const std::vector<V3d>& wanted, double spacing, const CertifyOptions& options) {
  std::vector<V3d> at = map.controls();
  for (int step = 0; step < kUntangleSteps; ++step) {
    report(options.progress, 0);  // may cancel
    std::vector<DeterminantSlope> constraints = determinantsAt(map, points, options.maxMemory);
    double lowest = kActive * least;
    for (const DeterminantSlope& c : constraints) lowest = std::min(lowest, c.value);
    std::erase_if(constraints,
                  [&](const DeterminantSlope& c) { return c.value > kActive * least + 0.5; });
    std::vector<V3d> next = leastChange(constraints, 1.02 * least, wanted, at);
    double longest = 0;
    for (std::size_t n = 0; n < at.size(); ++n)
      longest = std::max(longest, (next[n] - at[n]).length());
    if (lowest >= least && longest < 1e-4 * spacing) return;
    const double share = std::min(1.0, kUntangleStep * spacing / std::max(longest, 1e-300));
    for (std::size_t n = 0; n < at.size(); ++n) at[n] += (next[n] - at[n]) * share;
    map.move(at);
  }
}

}  // namespace

UntangleReport removeFolds(ControlledMap& map, const UntangleOptions& options) {
  if (!(options.leastShare > 0 && options.leastShare < 1))
    throw UsageError(fmt::format("the least share of volume is {}; give a number between 0 and 1",
                                 options.leastShare));
  UntangleReport report;
  const std::vector<V3d> wanted = map.controls(), identity = map.identity();
  const double size = controlDiagonal(identity);
  const double spacing =
      size / std::cbrt(static_cast<double>(std::max<std::size_t>(wanted.size(), 1)));
  const auto progressOf = [&](std::size_t round) {
    return 1 - 1 / (1 + 0.2 * static_cast<double>(round));
  };
  const auto certify = [&] {
    ++report.rounds;
    return map.certificate({.maxMemory = options.maxMemory,
                            .progress = subProgress(options.progress, progressOf(report.rounds - 1),
                                                    progressOf(report.rounds))});
  };
  FoldCertificate certificate = certify();
  if (certificate.isInjective()) return report;
  // Neither goes away with folds: the surface leaves the cage, or distant parts penetrate.
  if (certificate.isNearCage || certificate.verdict == FoldVerdict::Certified)
    requireInjective(certificate);
  std::vector<V3d> points = map.testPoints();
  double scale = 0;
  {
    const std::vector<DeterminantSlope> all = determinantsAt(map, points, options.maxMemory);
    for (const DeterminantSlope& one : all) scale += std::abs(one.value);
    scale /= static_cast<double>(std::max<std::size_t>(all.size(), 1));
  }
  double least = options.leastShare * std::max(scale, 1e-6);
  bool isDone = false;
  while (!isDone && report.rounds < kUntangleRounds) {
    for (const V3d& p : map.testPointsAround(certificate.place)) points.push_back(p);
    approach(map, points, least, wanted, spacing,
             {.maxMemory = options.maxMemory,
              .progress = subProgress(options.progress, progressOf(report.rounds),
                                      progressOf(report.rounds))});
    certificate = certify();
    isDone = certificate.isInjective();
    if (certificate.verdict == FoldVerdict::Certified || certificate.isNearCage) break;
    if (certificate.verdict == FoldVerdict::Undecided) least *= 1.3;
  }
  if (!isDone) {
    // Some share of the way from the identity always suffices.
    double low = 0, high = 1;
    const auto moveBy = [&](double share) {
      std::vector<V3d> controls = identity;
      for (std::size_t n = 0; n < controls.size(); ++n)
        controls[n] += (wanted[n] - identity[n]) * share;
      map.move(controls);
    };
    for (int halving = 0; halving < kHomotopyHalvings; ++halving) {
      const double middle = 0.5 * (low + high);
      moveBy(middle);
      certificate = certify();
      (certificate.isInjective() ? low : high) = middle;
    }
    moveBy(low);
    certificate = certify();
    requireInjective(certificate);
  }
  const std::vector<V3d> found = map.controls();
  double squares = 0;
  for (std::size_t n = 0; n < found.size(); ++n) {
    const double move = (found[n] - wanted[n]).length();
    report.movedPoints += move > kUnmoved * size;
    report.largestMove = std::max(report.largestMove, move);
    squares += move * move;
  }
  report.rootMeanSquareMove = std::sqrt(squares / static_cast<double>(found.size()));
  return report;
}

}  // namespace levelset::untangle
