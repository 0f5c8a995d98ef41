#include "apps/pipeline/runner.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <new>
#include <optional>
#include <set>
#include <utility>

#include "apps/pipeline/graph_file.h"
#include "apps/pipeline/refusal.h"
#include "apps/process_cost.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/inspect/check.h"
#include "levelset/sample.h"

namespace pipeline {
namespace {

/// Values of nodes that have run, as long as something is to take them.
class Values {
 public:
  /// @param uses  of each
  explicit Values(std::vector<std::size_t> uses) : uses_(std::move(uses)), values_(uses_.size()) {}

  void put(std::size_t node, Value value) {
    if (uses_[node] > 0) values_[node] = std::move(value);
  }
  /// The last that takes a value has it alone, and may work in its place.
  Value take(std::size_t node) {
    if (--uses_[node] > 0) return *values_[node];
    Value last = std::move(*values_[node]);
    values_[node].reset();
    return last;
  }

 private:
  std::vector<std::size_t> uses_;
  std::vector<std::optional<Value>> values_;
};

/// What was made, and that no other node takes.
std::vector<std::string> unusedValues(const Graph& graph) {
  const std::vector<std::size_t> uses = countUses(graph, std::vector<char>(graph.nodes.size(), 1));
  const std::set<std::size_t> results(graph.results.begin(), graph.results.end());
  std::vector<std::string> sentences;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    const Node& node = graph.nodes[i];
    if (!node.makes() || uses[i] > 0 || results.contains(i)) continue;
    sentences.push_back(
        fmt::format("the {}{} at the end of the chain is not used; write it, or leave it out",
                    kindName(node.kind), node.name.empty() ? "" : " '" + node.name + "'"));
  }
  return sentences;
}

/// Ends a chain in which a step left its value behind without reaching what was asked.
void tellFailures(const RunReport& report) {
  for (const StepReport& step : report.steps)
    if (!step.notes.failure.empty())
      throw levelset::NumericalError(step.action + ": " + step.notes.failure);
}

/// What the actions of a graph write.
class Targets {
 public:
  /// @return was it named before? As isSameFile would find, in the time of one look
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

/// Refuses targets that cannot be written before time is spent on what should go there.
/// @param earlier  what the actions before write; grows
void checkTargets(const Node& action, const RunSettings& settings, Targets& earlier,
                  RunReport& report) {
  if (!action.op->targets) return;
  try {
    for (const std::string& target : action.op->targets(Invocation(*action.op, action.options))) {
      const levelset::FileTarget probe(target);
      if (!earlier.add(target)) continue;
      if (!levelset::clobberDefault())
        throw levelset::IoError(
            fmt::format("{}: '{}' is written by an action before, and --no-clobber forbids to "
                        "overwrite it; use another file",
                        action.op->name, target));
      report.warnings.push_back(
          fmt::format("{}: '{}' is written by an action before, too, and only the last one stays; "
                      "use another file",
                      action.op->name, target));
      settings.warn(report.warnings.back());
    }
  } catch (const levelset::Error& error) {
    refuseAs(action.op->name, error);
  }
}

/// How far off a result may be, by what can be told from the result itself.
void estimateError(const Value& value, const Invocation& invocation, StepNotes& notes) {
  if (value.kind() == Kind::Band) {
    const levelset::CheckReport report = levelset::check(value.band());
    notes.errors.push_back({"eikonal residual, mean", report.eikonalMean, ""});
  } else if (value.kind() == Kind::Mesh && !invocation.operands.empty() &&
             invocation.operands[0].kind() == Kind::Band) {
    const levelset::NarrowBand& band = invocation.band();
    const levelset::BandSampler phi(band, levelset::Interpolation::Tricubic);
    const levelset::TriMesh& mesh = value.mesh();
    double worst = 0, sum = 0;
    for (const auto& t : mesh.triangles) {
      const Imath::V3d centre =
          (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0;
      const double distance = std::abs(phi.value(centre)) / band.voxelSize();
      worst = std::max(worst, distance);
      sum += distance;
    }
    notes.errors.push_back(
        {"distance of face centres to the zero set, mean",
         sum / static_cast<double>(std::max<std::size_t>(1, mesh.triangles.size())), "voxels"});
    notes.errors.push_back({"distance of face centres to the zero set, largest", worst, "voxels"});
  }
}

void describeResult(const Value& value, bool dryRun, StepReport& step) {
  step.resultKind = kindName(value.kind());
  if (value.kind() == Kind::Band || value.kind() == Kind::Surface) {
    step.voxelSize = value.plan().voxelSize;
    step.halfWidth = value.plan().halfWidth;
    step.activeVoxels =
        dryRun ? value.plan().activeVoxels() : static_cast<double>(value.band().activeVoxelCount());
  } else if (value.kind() == Kind::Mesh && !dryRun) {
    step.triangles = value.mesh().triangles.size();
  }
}

Plan planOf(Invocation& invocation) {
  const Operator& op = invocation.op();
  if (op.plan) return op.plan(invocation);
  Plan plan = invocation.operands.at(0).plan();
  if (op.resultKind) plan.kind = op.resultKind(invocation);
  return plan;
}

/// @param stop  ends the timing of the step; what follows is the report's own work
void runNode(const Graph& graph, std::size_t index, const RunSettings& settings, Values& values,
             StepReport& step, const std::function<void()>& stop) {
  const Node& node = graph.nodes[index];
  const Operator& op = *node.op;
  Invocation invocation(op, node.options);
  if (settings.begin) settings.begin(op.name);
  for (const std::size_t input : node.inputs) {
    invocation.operands.push_back(values.take(input));
    invocation.operandNames.push_back(graph.nodes[input].name);
  }
  for (const auto& [option, input] : node.named)
    invocation.named.emplace(option, values.take(input));
  invocation.maxMemory = settings.maxMemory;
  invocation.dryRun = settings.dryRun;
  if (settings.progress || settings.goesOn) {
    invocation.progress = [&, index](double fraction) {
      if (settings.progress) settings.progress(index, op.name, fraction);
      return !settings.goesOn || settings.goesOn();
    };
  }
  const auto finish = [&] {
    step.notes = invocation.notes;
    if (!invocation.output.empty() && settings.print) settings.print(invocation.output);
    for (const std::string& text : step.notes.warnings) settings.warn(sentenceOf(op.name, text));
    for (const std::string& text : step.notes.notes) settings.note(sentenceOf(op.name, text));
    // Told at the end, and by the report where it belongs.
    if (!step.notes.failure.empty()) step.notes.warnings.push_back(step.notes.failure);
  };
  try {
    if (settings.dryRun) {
      const Plan plan = planOf(invocation);
      invocation.resolveLengths();
      levelset::requireMemory(plan.bytes(), settings.maxMemory, op.name.c_str());
      if (op.flow == Flow::Makes) {
        const Value value(plan);
        describeResult(value, true, step);
        values.put(index, value);
      }
    } else {
      Value value = op.run(invocation);
      if (op.flow == Flow::Makes) {
        describeResult(value, false, step);
        stop();
        if (settings.measureErrors) estimateError(value, invocation, invocation.notes);
        if (settings.made) settings.made(index, value);
        values.put(index, std::move(value));
      }
    }
  } catch (...) {
    finish();
    throw;
  }
  finish();
}

}  // namespace

void run(const Graph& graph, const RunSettings& settings, RunReport& report) {
  const std::vector<char> needed = neededNodes(graph);
  Values values(countUses(graph, needed));
  report.dryRun = settings.dryRun;
  report.graphJson = graphJson(graph);
  try {
    Targets targets;
    for (const Node& node : graph.nodes) checkTargets(node, settings, targets, report);
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
      const Node& action = graph.nodes[i];
      if (!needed[i]) {
        report.leftOut.push_back(action.op->name + (action.name.empty() ? "" : " @" + action.name));
        continue;
      }
      if (const auto given = graph.given.find(i); given != graph.given.end()) {
        values.put(i, given->second);
        continue;
      }
      StepReport& step = report.steps.emplace_back();
      step.action = action.op->name;
      step.parameters = action.options;
      for (const Param& param : action.op->params)
        if (!param.fallback.empty() && !action.options.contains(param.name))
          step.defaults[param.name] = param.fallback;
      step.resultName = action.name;
      apps::resetPeakResident();
      const auto start = std::chrono::steady_clock::now();
      const double cpuStart = apps::processCpuSeconds();
      bool stopped = false;
      const auto stop = [&] {
        if (stopped) return;
        stopped = true;
        step.wallSeconds =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        step.cpuSeconds = apps::processCpuSeconds() - cpuStart;
        step.peakBytes = apps::peakResidentBytes();
      };
      try {
        runNode(graph, i, settings, values, step, stop);
        stop();
      } catch (const std::bad_alloc&) {
        stop();
        throw levelset::ResourceLimit(fmt::format(
            "{}: memory ran out; use larger voxels or a narrower band", action.op->name));
      } catch (const levelset::Error& error) {
        stop();
        refuseAs(action.op->name, error);
      } catch (const std::exception& error) {
        stop();
        if (!isWantOfThreads(error)) throw;
        throw levelset::ResourceLimit(action.op->name + kWantOfThreads);
      } catch (...) {
        stop();
        throw;
      }
    }
    for (const std::string& sentence : unusedValues(graph)) {
      report.warnings.push_back(sentence);
      settings.warn(sentence);
    }
    tellFailures(report);
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
