#include <fmt/core.h>

#include <sstream>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "apps/regress/suite.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

void listCases(std::string& text) {
  for (const regress::Case& c : regress::cases())
    text += fmt::format("{:<20}{}\n", c.name, c.title);
}

std::vector<std::string> caseNames(const Invocation& in) {
  std::vector<std::string> all;
  if (!in.given("case")) return all;
  std::istringstream text(in.text("case"));
  for (std::string name; std::getline(text, name, ',');) all.push_back(name);
  return all;
}

void appendLine(const regress::CaseResult& result, std::string& text) {
  const std::size_t missed = regress::failures(result).size();
  text += fmt::format("{:<6}{:<20}{:>4} runs {:>4} bounds {:>8.1f} CPU s\n", missed ? "FAIL" : "ok",
                      result.of->name, result.rows.size(),
                      result.judgements.size() + result.outcomes.size(), result.cpuSeconds);
}

void validateRegression(const Invocation& in) {
  regress::checkNames(caseNames(in));
  if (!in.given("out") && !in.flag("list"))
    throw levelset::UsageError("regress: --out is missing; name the folder for the results");
}

Value runRegression(Invocation& in) {
  if (in.flag("list")) {
    listCases(in.output);
    return Value(Plan{});
  }
  regress::makeFolder(in.text("out"));
  const regress::SuiteResult result = regress::runSuite(
      {.names = caseNames(in),
       .budget = in.text("budget") == "full" ? regress::Budget::Full : regress::Budget::Quick,
       .progress = in.progress,
       .finished = [&](const regress::CaseResult& c) { appendLine(c, in.output); }});
  in.notes.notes = regress::writeResults(result, in.text("out"), !in.flag("no-plots"));
  const std::vector<std::string> failed = regress::failures(result);
  for (const std::string& sentence : failed) in.output += "missed: " + sentence + "\n";
  if (!failed.empty())
    throw levelset::NumericalError(
        fmt::format("regress: {} bounds are missed, the first is: {}; see index.html in '{}'",
                    failed.size(), failed[0], in.text("out")));
  return Value(Plan{});
}

}  // namespace

Operator regressOperator() {
  return {
      .name = "regress",
      .group = "Inspection",
      .summary = "run problems with exact solutions and report errors and run times",
      .details =
          "Each case runs at several resolutions and at five positions of the object relative to "
          "the grid points. OpenVDB's own tool runs on the same problem where it has one. The "
          "folder receives results.json, results.csv, plots and index.html. The exit code is 5 "
          "when an accuracy bound is missed, after everything is written. Times are shown but have "
          "no bound.",
      .example = "levelsmith regress --case empty-and-full --out regression",
      .params = {{.name = "case",
                  .type = ParamType::Text,
                  .doc = "names of the cases to run, separated by commas; default: all"},
                 {.name = "budget",
                  .type = ParamType::Choice,
                  .doc = "quick: coarse resolutions, under three minutes on two cores; full: all "
                         "resolutions",
                  .fallback = "quick",
                  .choices = {"quick", "full"}},
                 {.name = "out",
                  .type = ParamType::Path,
                  .doc = "folder for the results; created if it is missing"},
                 {.name = "no-plots",
                  .type = ParamType::Flag,
                  .doc = "draw no plots; plots.py in the folder of --out can draw them later"},
                 {.name = "list",
                  .type = ParamType::Flag,
                  .doc = "print the names and titles of all cases and run none"}},
      .isRepeatable = false,
      .flow = Flow::PassesThrough,
      .run = runRegression,
      .plan = [](Invocation&) { return Plan{}; },
      .validate = validateRegression,
  };
}

}  // namespace pipeline
