#include "apps/regress/recorder.h"

#include <fmt/core.h>

#include <cmath>

#include "apps/process_cost.h"

namespace regress {

using levelset::ExitCode;
using levelset::NarrowBand;

const std::vector<Imath::V3d>& subVoxelPhases() {
  static const std::vector<Imath::V3d> phases = {
      {0, 0, 0}, {0.5, 0.5, 0.5}, {0.25, 0.5, 0.75}, {0.137, 0.419, 0.731}, {0.903, 0.311, 0.058}};
  return phases;
}

Recorder::Recorder(const Case& of, Budget budget, levelset::Progress progress)
    : budget_(budget), progress_(std::move(progress)) {
  result_.of = &of;
}

std::vector<Sample> Recorder::samples() const {
  std::vector<Sample> all;
  const std::vector<int>& resolutions = isQuick() ? result_.of->quick : result_.of->full;
  for (const int resolution : resolutions) {
    const double h = 1.0 / resolution;
    for (int phase = 0; phase < static_cast<int>(subVoxelPhases().size()); ++phase) {
      if (isQuick() && resolution != resolutions.front() && phase != kQuickPhase) continue;
      all.push_back({resolution, phase, h, subVoxelPhases()[static_cast<std::size_t>(phase)] * h});
    }
  }
  return all;
}

bool Recorder::wantsPeer(const Sample& at, int finest, int phases) const {
  return isQuick() ? at.phase == kQuickPhase && at.resolution <= finest : at.phase < phases;
}

bool Recorder::wantsRepeats(const Sample& at) const {
  return !isQuick() || (at.phase == kQuickPhase && at.resolution == result_.of->quick.front());
}

void Recorder::tick() {
  levelset::report(progress_, 0);
}

std::optional<NarrowBand> Recorder::measure(
    const std::string& variant, const Sample& at, const std::string& tool,
    const std::function<NarrowBand()>& work,
    const std::function<void(const NarrowBand&, Figures&)>& look) {
  tick();
  Row& row = result_.rows.emplace_back(Row{variant, tool, at.resolution, at.phase, {}, {}});
  std::optional<NarrowBand> made;
  try {
    const apps::Cost cost = apps::costOf([&] { made = work(); });
    row.figures["cpu_s"] = cost.cpuSeconds;
    row.figures["peak_bytes"] = cost.peakBytes;
    look(*made, row.figures);
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (const std::exception& error) {
    row.failure = error.what();
    row.figures.clear();
    made.reset();
  }
  return made;
}

std::optional<NarrowBand> Recorder::measure(const Subject& subject, const std::string& tool,
                                            const std::function<NarrowBand()>& work) {
  return measure(subject.variant, subject.at, tool, work, [&](const NarrowBand& made, Figures& of) {
    addErrors(made, subject.truth, tool == kOurs ? Mesher::Ours : Mesher::OpenVdb, of,
              isQuick() ? kQuickRayCount : kRayCount);
    addInvariants(made, subject.truth, of);
  });
}

void Recorder::measure(const std::string& variant, const Sample& at, const NarrowBand& reference,
                       const std::string& tool, const std::function<NarrowBand()>& work) {
  measure(variant, at, tool, work,
          [&](const NarrowBand& made, Figures& of) { addDifferences(made, reference, of); });
}

void Recorder::row(const std::string& variant, const std::string& tool, const Sample& at,
                   Figures figures) {
  tick();
  result_.rows.push_back({variant, tool, at.resolution, at.phase, std::move(figures), {}});
}

void Recorder::expectRefusal(const std::string& variant, ExitCode code,
                             const std::function<void()>& work) {
  tick();
  Outcome& outcome = result_.outcomes.emplace_back();
  outcome.variant = variant;
  outcome.expected = fmt::format("refused, exit code {}", static_cast<int>(code));
  try {
    work();
    outcome.found = "was not refused";
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (const levelset::Error& error) {
    outcome.passed = error.exitCode() == code;
    outcome.found =
        fmt::format("exit code {}: {}", static_cast<int>(error.exitCode()), error.what());
  } catch (const std::exception& error) {
    outcome.found = fmt::format("unexpected failure: {}", error.what());
  }
}

void Recorder::expect(const std::string& variant, const std::string& expected,
                      const std::function<std::pair<bool, std::string>()>& work) {
  tick();
  Outcome& outcome = result_.outcomes.emplace_back();
  outcome.variant = variant;
  outcome.expected = expected;
  try {
    std::tie(outcome.passed, outcome.found) = work();
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (const std::exception& error) {
    outcome.found = fmt::format("refused: {}", error.what());
  }
}

CaseResult Recorder::finish() {
  result_.summary = summarize(result_.rows);
  result_.judgements = judge(*result_.of, result_.summary, budget_);
  return std::move(result_);
}

}  // namespace regress
