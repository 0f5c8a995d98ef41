#include "apps/pipeline/run/runner.h"

#include <fmt/core.h>

#include <filesystem>
#include <set>

#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/run/graph_run.h"
#include "apps/pipeline/values/refusal.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace pipeline {
namespace {

/// Lists a warning for each value that no node takes and no caller requests.
std::vector<std::string> unusedValues(const Graph& graph) {
  const std::vector<std::size_t> uses = countUses(graph, std::vector<char>(graph.nodes.size(), 1));
  const std::set<std::size_t> results(graph.results.begin(), graph.results.end());
  std::vector<std::string> sentences;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    const Node& node = graph.nodes[i];
    if (!node.makes() || uses[i] > 0 || results.contains(i)) continue;
    sentences.push_back(withLocation(
        fmt::format(
            "the {}{} at the end of the chain is not used; write it, or leave out its action",
            kindName(node.kind), node.name.empty() ? "" : " '" + node.name + "'"),
        node.location));
  }
  return sentences;
}

/// Throws if a step missed its requested accuracy but still produced a value.
void throwFailures(const RunReport& report) {
  for (const StepReport& step : report.steps)
    if (!step.notes.failure.empty())
      throw levelset::NumericalError(
          withLocation(sentenceOf(step.action, step.notes.failure), step.location));
}

/// Files that the actions of a graph write.
class Targets {
 public:
  /// Adds a file.
  /// @return true if an earlier name denotes the same file
  bool add(const std::string& target) {
    const bool isDash = target == "-", isOutput = levelset::isStandardOutput(target);
    const std::filesystem::path file = levelset::canonicalFile(target);
    const bool isAgain = isDash ? hasOutput_ : isOutput && hasDash_;
    hasDash_ = hasDash_ || isDash;
    hasOutput_ = hasOutput_ || isOutput;
    return (!file.empty() && !files_.insert(file).second) || isAgain;
  }

 private:
  std::set<std::filesystem::path> files_;
  bool hasDash_ = false, hasOutput_ = false;
};

/// Rejects output files that cannot be written, before any action runs.
/// @param earlier  files of the earlier actions; receives the files of this action
void checkTargets(const Node& action, const RunSettings& settings, Targets& earlier,
                  RunReport& report) {
  if (!action.op->targets) return;
  try {
    for (const std::string& target : action.op->targets(Invocation(*action.op, action.options))) {
      const levelset::FileTarget probe(target);
      if (!earlier.add(target)) continue;
      if (!levelset::clobberDefault())
        throw levelset::IoError(fmt::format(
            "{}: an earlier action writes '{}' too, and --no-clobber forbids overwriting it; use "
            "another file",
            action.op->name, target));
      report.warnings.push_back(
          withLocation(fmt::format("{}: an earlier action writes '{}' too, and only the later "
                                   "content remains; use another file",
                                   action.op->name, target),
                       action.location));
      settings.warn(report.warnings.back());
    }
  } catch (const levelset::Error& error) {
    rethrowAs(action.op->name, error, action.location);
  }
}

}  // namespace

void run(const Graph& graph, const RunSettings& settings, RunReport& report) {
  report.dryRun = settings.dryRun;
  report.graphJson = graphJson(graph);
  try {
    Targets targets;
    for (const Node& node : graph.nodes) checkTargets(node, settings, targets, report);
    GraphRun(graph, settings, report).run();
    for (const std::string& sentence : unusedValues(graph)) {
      report.warnings.push_back(sentence);
      settings.warn(sentence);
    }
    throwFailures(report);
  } catch (const levelset::Error& error) {
    report.error = error.what();
    report.exitCode = static_cast<int>(error.exitCode());
    throw;
  } catch (const std::exception& error) {
    report.error = error.what();
    report.exitCode = static_cast<int>(levelset::ExitCode::Input);
    throw;
  }
}

}  // namespace pipeline
