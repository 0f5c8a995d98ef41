#include <algorithm>
#include <cmath>

#include "levelset/curvature_flow/curvature_rate_vdb.h"
#include "levelset/curvature_flow/curvature_steps_vdb.h"

namespace levelset::flow {
namespace {

struct NoScratch {};

// Cost of an iteration of the HelmholtzSolver in evaluations of φ_t. An iteration reads 7 values
// for each grid point and an evaluation 37, but both also read and write complete fields.
constexpr double kIterationCost = 0.5;

}  // namespace

int legendreStages(double dt) {
  // Solves the stability limit dt = kExplicitStep (s² + s − 2) / 4 for the number of stages s.
  const double s = (std::sqrt(9 + 16 * dt / kExplicitStep) - 1) / 2;
  return std::max(3, static_cast<int>(std::ceil(s - 1e-9)) | 1);
}

double predictedCost(FlowScheme scheme, double dt) {
  switch (scheme) {
    case FlowScheme::Explicit:
      return std::max(1.0, std::ceil(dt / kExplicitStep));
    case FlowScheme::Implicit:
      return 2 + kIterationCost * (HelmholtzSolver::predictedIterations(dt) +
                                   2 * HelmholtzSolver::predictedIterations(dt / 2));
    default:
      return legendreStages(dt);
  }
}

CurvatureSteps::CurvatureSteps(CurvatureState& state, std::function<void()> pulse)
    : state_(state), pulse_(std::move(pulse)) {
  for (Field* field : {&before_, &rate_, &rateBefore_, &last_, &older_, &stageRate_})
    field->assign(state.blocks().size(), Values{});
  refreshRate();
}

void CurvatureSteps::evaluate(const Field& field, Field& rate) {
  pulse_();
  state_.evaluate(field, shift, rate);
  ++work_;
}

void CurvatureSteps::refreshRate() {
  evaluate(state_.value, rate_);
}

void CurvatureSteps::undo() {
  state_.value = before_;
  rate_ = rateBefore_;
}

void CurvatureSteps::raise(double by) {
  state_.blocks().forEach<NoScratch>([&](std::size_t i, NoScratch&) {
    for (std::size_t n = 0; n < 512; ++n) {
      const double weight =
          state_.weights().empty() ? 1 : static_cast<double>(state_.weights()[i][n]);
      state_.value[i][n] += static_cast<float>(by * weight);
    }
  });
}

template <typename Error>
double CurvatureSteps::rmsNearSurface(const Error& error) const {
  struct Sum {
    double squares = 0, count = 0;
    Sum& operator+=(const Sum& other) {
      squares += other.squares;
      count += other.count;
      return *this;
    }
  };
  const Sum sum = state_.blocks().sum<Sum>([&](std::size_t i) {
    // Averages the signed error over a block before squaring it. An error that alternates between
    // grid points is rounding of the distances: any step damps it, and shorter steps do not avoid
    // it.
    double total = 0, count = 0;
    for (auto it = state_.blocks().active(i).beginOn(); it; ++it) {
      if (!(std::abs(before_[i][it.pos()]) < 1)) continue;
      total += error(i, it.pos());
      ++count;
    }
    return count > 0 ? Sum{total * total / count, count} : Sum{};
  });
  return sum.count > 0 ? std::sqrt(sum.squares / sum.count) : 0;
}

double CurvatureSteps::take(FlowScheme scheme, double dt) {
  before_ = state_.value;
  rateBefore_ = rate_;
  double error = 0;
  if (scheme == FlowScheme::Implicit)
    error = implicitStep(dt);
  else if (scheme == FlowScheme::Explicit)
    eulerStep(dt);
  else
    legendreStep(dt);
  evaluate(state_.value, rate_);
  const auto d = [](float x) { return static_cast<double>(x); };
  if (scheme == FlowScheme::Explicit)
    error = rmsNearSurface([&](std::size_t i, openvdb::Index n) {
      return dt / 2 * (d(rate_[i][n]) - d(rateBefore_[i][n]));
    });
  else if (scheme == FlowScheme::Stabilized)  // [Sommeijer98, 2.4]
    error = rmsNearSurface([&](std::size_t i, openvdb::Index n) {
      return (12 * (d(before_[i][n]) - d(state_.value[i][n])) +
              6 * dt * (d(rate_[i][n]) + d(rateBefore_[i][n]))) /
             15;
    });
  return error;
}

void CurvatureSteps::eulerStep(double dt) {
  state_.blocks().forEach<NoScratch>([&](std::size_t i, NoScratch&) {
    for (std::size_t n = 0; n < 512; ++n)
      state_.value[i][n] += static_cast<float>(dt) * rate_[i][n];
  });
}

// Equations 16 to 18 of [Meyer14], for the change of φ since the beginning of the step instead of φ
// itself: the recursion over s stages multiplies rounding errors by about s², and the change is
// small.
void CurvatureSteps::legendreStep(double dt) {
  const int stages = legendreStages(dt);
  const auto b = [](int j) { return j < 2 ? 1.0 / 3 : (j * j + j - 2.0) / (2.0 * j * (j + 1)); };
  const double w = 4.0 / (stages * stages + stages - 2);
  const auto f = [](double x) { return static_cast<float>(x); };
  state_.blocks().forEach<NoScratch>([&](std::size_t i, NoScratch&) {
    older_[i].fill(0);
    for (std::size_t n = 0; n < 512; ++n) {
      last_[i][n] = f(b(1) * w * dt) * rateBefore_[i][n];
      state_.value[i][n] = before_[i][n] + last_[i][n];
    }
  });
  for (int j = 2; j <= stages; ++j) {
    evaluate(state_.value, stageRate_);
    const double mu = (2.0 * j - 1) / j * b(j) / b(j - 1), nu = (1.0 - j) / j * b(j) / b(j - 2);
    const float m = f(mu), v = f(nu), mt = f(mu * w * dt), gt = f(-(1 - b(j - 1)) * mu * w * dt);
    state_.blocks().forEach<NoScratch>([&](std::size_t i, NoScratch&) {
      for (std::size_t n = 0; n < 512; ++n) {
        older_[i][n] =
            (m * last_[i][n] + v * older_[i][n]) + (mt * stageRate_[i][n] + gt * rateBefore_[i][n]);
        state_.value[i][n] = before_[i][n] + older_[i][n];
      }
    });
    std::swap(last_, older_);
  }
}

// Linearly implicit Euler steps with the Laplacian in place of the derivative of the rate
// [Smereka03]. Twice the result of two half steps minus the result of one full step is of second
// order.
double CurvatureSteps::implicitStep(double dt) {
  if (!solver_) solver_ = std::make_unique<HelmholtzSolver>(state_.blocks(), state_.weights());
  work_ += kIterationCost * solver_->solve(dt, rateBefore_, last_, pulse_);
  work_ += kIterationCost * solver_->solve(dt / 2, rateBefore_, older_, pulse_);
  state_.blocks().forEach<NoScratch>([&](std::size_t i, NoScratch&) {
    for (std::size_t n = 0; n < 512; ++n) state_.value[i][n] = before_[i][n] + older_[i][n];
  });
  evaluate(state_.value, stageRate_);
  work_ += kIterationCost * solver_->solve(dt / 2, stageRate_, stageRate_, pulse_);
  state_.blocks().forEach<NoScratch>([&](std::size_t i, NoScratch&) {
    for (std::size_t n = 0; n < 512; ++n) {
      older_[i][n] += stageRate_[i][n];  // change of φ by the two half steps
      last_[i][n] = older_[i][n] - last_[i][n];
      state_.value[i][n] = before_[i][n] + older_[i][n] + last_[i][n];
    }
  });
  return rmsNearSurface(
      [&](std::size_t i, openvdb::Index n) { return static_cast<double>(last_[i][n]); });
}

}  // namespace levelset::flow
