#pragma once

#include <fmt/core.h>

#include <algorithm>

#include "levelset/rbf/rbf_cloud.h"

namespace levelset::rbf {

/// Factorises a system that may be singular within rounding errors. Beyond a condition number of
/// 1e15 a solution has no correct digits. Then 1e-14 of the system's norm, or 10, 100, … times as
/// much, is added to its diagonal. Adds the condition number and a note to the report.
/// @param factorise  factorises the system with the ridge, a share of its norm, on its diagonal;
///         returns the reciprocal of its condition number, 0 if it is not positive definite
template <typename Factorise>
void raiseUntilDefinite(RbfSolveReport& report, const Factorise& factorise) {
  constexpr double kWorstCondition = 1e15, kFirstRidge = 1e-14, kLastRidge = 1e-3;
  for (double ridge = 0;; ridge = std::max(10 * ridge, kFirstRidge)) {
    const double reciprocal = factorise(ridge);
    if (reciprocal * kWorstCondition < 1 && ridge <= kLastRidge) continue;
    report.condition = 1 / reciprocal;
    if (ridge > 0) {
      report.isRegularized = true;
      report.notes.push_back(fmt::format(
          "the particles' system is singular within rounding errors; {:.0e} of its norm was added "
          "to its diagonal; some particles are much closer than others",
          ridge));
    }
    return;
  }
}

}  // namespace levelset::rbf
