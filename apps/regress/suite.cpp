#include "apps/regress/suite.h"

#include <fmt/core.h>

#include <algorithm>
#include <exception>

#include "apps/process_cost.h"
#include "apps/regress/recorder.h"
#include "levelset/error.h"

namespace regress {

const std::vector<Case>& cases() {
  static const std::vector<Case> all = [] {
    std::vector<Case> list;
    addShapeCases(list);
    addMeshCases(list);
    addRedistanceCases(list);
    addPointCases(list);
    addOffsetCases(list);
    addCsgCases(list);
    addEmbossCases(list);
    addMorphologyCases(list);
    addFilletCases(list);
    addEikonalCases(list);
    addCurvatureCases(list);
    addSmoothCases(list);
    addAdvectionCases(list);
    addMorphCases(list);
    addResampleCases(list);
    addKalbeCases(list);
    addLookupCases(list);
    addExtremeCases(list);
    addBadInputCases(list);
    return list;
  }();
  return all;
}

namespace {

std::vector<const Case*> chosen(const std::vector<std::string>& names) {
  std::vector<const Case*> list;
  for (const Case& c : cases())
    if (names.empty() || std::find(names.begin(), names.end(), c.name) != names.end())
      list.push_back(&c);
  for (const std::string& name : names)
    if (std::none_of(list.begin(), list.end(), [&](const Case* c) { return c->name == name; }))
      throw levelset::UsageError(
          fmt::format("regress: there is no case '{}'; --list prints all names", name));
  return list;
}

/// Runs a case. An exception that the case does not catch becomes a failed outcome, so that the
/// other cases still run.
void runWhole(const Case& of, Recorder& recorder) {
  std::exception_ptr failure;
  try {
    of.run(recorder);
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (...) {
    failure = std::current_exception();
  }
  if (failure)
    recorder.expect("whole case", "runs to its end",
                    [&]() -> std::pair<bool, std::string> { std::rethrow_exception(failure); });
}

}  // namespace

void checkNames(const std::vector<std::string>& names) {
  (void)chosen(names);
}

SuiteResult runSuite(const SuiteOptions& options) {
  const std::vector<const Case*> list = chosen(options.names);
  SuiteResult result;
  result.budget = options.budget;
  const double start = apps::processCpuSeconds();
  for (std::size_t i = 0; i < list.size(); ++i) {
    const auto count = static_cast<double>(list.size());
    const auto from = static_cast<double>(i);
    const double caseStart = apps::processCpuSeconds();
    Recorder recorder(*list[i], options.budget,
                      levelset::subProgress(options.progress, from / count, (from + 1) / count));
    runWhole(*list[i], recorder);
    result.cases.push_back(recorder.finish());
    result.cases.back().cpuSeconds = apps::processCpuSeconds() - caseStart;
    if (options.finished) options.finished(result.cases.back());
  }
  levelset::report(options.progress, 1);
  result.cpuSeconds = apps::processCpuSeconds() - start;
  return result;
}

std::vector<std::string> failures(const CaseResult& result) {
  std::vector<std::string> sentences;
  for (const Judgement& j : result.judgements) {
    if (j.passed) continue;
    const std::string what =
        fmt::format("{}: {} at resolution {}: ", result.of->name, j.bound.variant, j.resolution);
    sentences.push_back(
        j.remark.empty()
            ? fmt::format("{}{} is {:.4g}, the bound is {} {:.4g}", what, j.bound.figure, j.found,
                          j.bound.sense == Sense::AtMost ? "≤" : "≥", j.bound.limit())
            : fmt::format("{}{}: {}", what, j.bound.figure, j.remark));
  }
  for (const Outcome& o : result.outcomes)
    if (!o.passed)
      sentences.push_back(fmt::format("{}: {}: expected {}, found {}", result.of->name, o.variant,
                                      o.expected, o.found));
  return sentences;
}

std::vector<std::string> failures(const SuiteResult& result) {
  std::vector<std::string> all;
  for (const CaseResult& c : result.cases) {
    const std::vector<std::string> some = failures(c);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

}  // namespace regress
