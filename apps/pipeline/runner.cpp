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

#include "apps/pipeline/cache.h"
#include "apps/pipeline/cache_key.h"
#include "apps/pipeline/demand.h"
#include "apps/pipeline/graph_file.h"
#include "apps/pipeline/planner.h"
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
  /// Makes `take` find nothing, so that it has to be put again.
  void drop(std::size_t node) { values_[node].reset(); }
  /// @param uses  of each
  explicit Values(std::vector<std::size_t> uses) : uses_(std::move(uses)), values_(uses_.size()) {}

  [[nodiscard]] bool has(std::size_t node) const { return values_[node].has_value(); }
  [[nodiscard]] const Value& peek(std::size_t node) const { return *values_[node]; }
  void addUse(std::size_t node) { ++uses_[node]; }
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
    sentences.push_back(withPlace(
        fmt::format("the {}{} at the end of the chain is not used; write it, or leave it out",
                    kindName(node.kind), node.name.empty() ? "" : " '" + node.name + "'"),
        node.place));
  }
  return sentences;
}

/// Ends a chain in which a step left its value behind without reaching what was asked.
void tellFailures(const RunReport& report) {
  for (const StepReport& step : report.steps)
    if (!step.notes.failure.empty())
      throw levelset::NumericalError(
          withPlace(step.action + ": " + step.notes.failure, step.place));
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
      report.warnings.push_back(withPlace(
          fmt::format("{}: '{}' is written by an action before, too, and only the last one stays; "
                      "use another file",
                      action.op->name, target),
          action.place));
      settings.warn(report.warnings.back());
    }
  } catch (const levelset::Error& error) {
    refuseAs(action.op->name, error, action.place);
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

/// Measures a step until it is told to stop; what follows is the report's own work.
class StepClock {
 public:
  explicit StepClock(StepReport& step)
      : step_(step), start_(std::chrono::steady_clock::now()), cpu_(apps::processCpuSeconds()) {
    apps::resetPeakResident();
  }
  ~StepClock() { stop(); }
  StepClock(const StepClock&) = delete;
  StepClock& operator=(const StepClock&) = delete;

  void stop() {
    if (std::exchange(isStopped_, true)) return;
    step_.wallSeconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    step_.cpuSeconds = apps::processCpuSeconds() - cpu_;
    step_.peakBytes = apps::peakResidentBytes();
  }

 private:
  StepReport& step_;
  std::chrono::steady_clock::time_point start_;
  double cpu_;
  bool isStopped_ = false;
};

/// One run of a graph.
class GraphRun {
 public:
  GraphRun(const Graph& graph, const RunSettings& settings, RunReport& report)
      : graph_(graph), settings_(settings), report_(report), values_(planned()) {}

  void run() {
    findDemands();
    std::size_t known = 0, ran = 0;
    for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
      const Node& node = graph_.nodes[i];
      if (fates_[i] == Fate::LeftOut) {
        report_.leftOut.push_back(node.op->name + (node.name.empty() ? "" : " @" + node.name));
      } else if (const auto given = graph_.given.find(i); given != graph_.given.end()) {
        values_.put(i, given->second);
      } else if (fates_[i] == Fate::Run || wasEarly_[i]) {
        if (!std::exchange(wasEarly_[i], 0)) compute(i);
        ++ran;
      } else {
        recall(i);
        ++known;
      }
    }
    if (known > 0)
      settings_.note(
          ran == 0
              ? fmt::format("nothing was computed: all {} results are of an earlier run", known)
              : fmt::format("{} of {} results are of an earlier run", known, known + ran));
  }

 private:
  enum class Fate {
    LeftOut,  // nothing needs it
    Run,
    Load,  // its value is known, and taken by one that runs
    Known  // and not even that is needed
  };

  /// Decides on the fates. @return by node: how many that run take its value
  std::vector<std::size_t> planned() {
    const std::vector<char> needed = neededNodes(graph_);
    fates_.resize(graph_.nodes.size());
    for (std::size_t i = 0; i < fates_.size(); ++i)
      fates_[i] = needed[i] ? Fate::Run : Fate::LeftOut;
    if (!settings_.cache.empty() && !settings_.dryRun) useCache(needed);
    std::vector<char> runs(fates_.size());
    for (std::size_t i = 0; i < fates_.size(); ++i) runs[i] = fates_[i] == Fate::Run;
    return countUses(graph_, runs);
  }

  void useCache(const std::vector<char>& needed) {
    cache_.emplace(settings_.cache);
    keys_ = CacheKeys(*cache_, settings_.maxMemory).of(graph_, needed);
    std::vector<char> taken(graph_.nodes.size(), 0);
    for (const std::size_t result : graph_.results) taken[result] = 1;
    for (std::size_t i = graph_.nodes.size(); i-- > 0;) {
      const Node& node = graph_.nodes[i];
      if (!needed[i]) continue;
      const bool isKnown = keys_[i] && cache_->has(*keys_[i]);
      if (!node.makes()) {
        if (isKnown && isUpToDate(*keys_[i])) fates_[i] = Fate::Known;
      } else if (!taken[i] && hasTakers(i, needed)) {
        fates_[i] = Fate::Known;
      } else if (isKnown && Cache::canHold(node.kind)) {
        fates_[i] = Fate::Load;
      }
      if (fates_[i] != Fate::Run) continue;
      for (const std::size_t input : node.inputs) taken[input] = 1;
      for (const auto& [option, input] : node.named) taken[input] = 1;
    }
  }

  /// Is it there for others? What ends a chain is made for itself.
  [[nodiscard]] bool hasTakers(std::size_t i, const std::vector<char>& needed) const {
    return countUses(graph_, needed)[i] > 0;
  }

  /// Are the files there as they were left?
  [[nodiscard]] bool isUpToDate(const std::string& key) const {
    const std::optional<CachedStep> step = cache_->step(key);
    return step && std::all_of(step->files.begin(), step->files.end(),
                               [](const FileStamp& file) { return stampOf(file.path) == file; });
  }

  /// Finds how much of each value is needed, so that no more is made. Values that others may ask
  /// for later, out of a cache or of Python, are whole.
  void findDemands() {
    wasEarly_.resize(graph_.nodes.size());
    demands_.resize(graph_.nodes.size());
    plans_.resize(graph_.nodes.size());
    std::vector<char> runs(graph_.nodes.size());
    for (std::size_t i = 0; i < runs.size(); ++i) runs[i] = fates_[i] == Fate::Run;
    if (settings_.wholeValues || cache_ || settings_.made || settings_.dryRun ||
        !mayAskForLess(graph_, runs))
      return;
    plans_ =
        plansOf(graph_, runs, settings_.maxMemory, [&](std::size_t i) { return planEarly(i); });
    demands_ = demandsOf(graph_, runs, plans_);
    requireMemoryFor(graph_, plans_, demands_, settings_.maxMemory);
  }

  /// To plan a mesh is to read it: so it is made now.
  std::optional<Plan> planEarly(std::size_t i) {
    compute(i);
    wasEarly_[i] = 1;
    if (!values_.has(i)) return {};
    return values_.peek(i).plan();
  }

  /// Did it take or make less than the whole?
  [[nodiscard]] bool isPartial(std::size_t i) const {
    const std::vector<std::size_t>& inputs = graph_.nodes[i].inputs;
    return !demands_[i].isWhole() ||
           std::any_of(inputs.begin(), inputs.end(),
                       [&](std::size_t input) { return !demands_[input].isWhole(); });
  }

  /// From now on it and all that it is made of are whole.
  void makeWhole(std::size_t i) {
    const Node& node = graph_.nodes[i];
    demands_[i] = {};
    for (const std::size_t input : node.inputs) {
      if (!demands_[input].isWhole()) values_.drop(input);
      makeWhole(input);
    }
  }

  StepReport& begin(const Node& node) {
    StepReport& step = report_.steps.emplace_back();
    step.action = node.op->name;
    step.parameters = node.options;
    for (const Param& param : node.op->params)
      if (!param.fallback.empty() && !node.options.contains(param.name))
        step.defaults[param.name] = param.fallback;
    step.resultName = node.name;
    step.place = node.place;
    return step;
  }

  void tell(const Node& node, const std::string& output, StepReport& step) {
    if (!output.empty() && settings_.print) settings_.print(output);
    for (const std::string& text : step.notes.warnings)
      settings_.warn(withPlace(sentenceOf(node.op->name, text), node.place));
    for (const std::string& text : step.notes.notes)
      settings_.note(sentenceOf(node.op->name, text));
    // Told at the end, and by the report where it belongs.
    if (!step.notes.failure.empty()) step.notes.warnings.push_back(step.notes.failure);
  }

  /// Of the step that was begun last.
  [[nodiscard]] bool asksThumbnail() const { return report_.steps.size() <= settings_.thumbnails; }

  /// What is known of a node is told again, and its value brought where one is taken.
  void recall(std::size_t i) {
    const Node& node = graph_.nodes[i];
    std::optional<Value> value;
    if (fates_[i] == Fate::Load) {
      value = cache_->value(*keys_[i], settings_.maxMemory);
      if (!value) return compute(i);
    }
    StepReport& step = begin(node);
    step.isKnown = true;
    std::string output;
    if (keys_[i])
      if (std::optional<CachedStep> known = cache_->step(*keys_[i])) {
        step.notes = std::move(known->notes);
        output = std::move(known->output);
      }
    if (value) {
      describeResult(*value, false, step);
      if (asksThumbnail()) step.thumbnail = thumbnailOf(*value, settings_.maxMemory);
      if (settings_.made) settings_.made(i, *value);
      values_.put(i, std::move(*value));
    }
    tell(node, output, step);
  }

  /// Also where an entry of the cache was damaged, and what it was made of has to be made again.
  void compute(std::size_t i) {
    if (const auto given = graph_.given.find(i); given != graph_.given.end())
      return values_.put(i, given->second);
    const Node& node = graph_.nodes[i];
    const bool isPlanned = fates_[i] == Fate::Run;  // its uses of others are counted
    fates_[i] = Fate::Known;  // to those who may ask for it again, once its value was let go
    if (!isPlanned) {
      for (const std::size_t input : node.inputs) values_.addUse(input);
      for (const auto& [option, input] : node.named) values_.addUse(input);
    }
    const auto bring = [&](std::size_t input) {
      if (values_.has(input)) return;
      if (cache_ && fates_[input] == Fate::Known && keys_[input] &&
          Cache::canHold(graph_.nodes[input].kind) && cache_->has(*keys_[input]))
        fates_[input] = Fate::Load;
      if (fates_[input] == Fate::Load)
        recall(input);
      else
        compute(input);
    };
    for (const std::size_t input : node.inputs) bring(input);
    for (const auto& [option, input] : node.named) bring(input);
    StepReport& step = begin(node);
    step.needed = demands_[i].part;
    StepClock clock(step);
    try {
      try {
        runNode(i, step, clock);
      } catch (const levelset::ResourceLimit&) {
        throw;
      } catch (const levelset::Cancelled&) {
        throw;
      } catch (const levelset::Error&) {
        if (!isPartial(i)) throw;
        // What is refused of a part may be right of the whole, and otherwise that has to be said.
        makeWhole(i);
        fates_[i] = Fate::Load;  // its uses of others have to be counted again
        report_.steps.pop_back();
        return compute(i);
      }
    } catch (const std::bad_alloc&) {
      throw levelset::ResourceLimit(withPlace(
          node.op->name + ": memory ran out; use larger voxels or a narrower band", node.place));
    } catch (const levelset::Error& error) {
      refuseAs(node.op->name, error, node.place);
    } catch (const std::exception& error) {
      if (!isWantOfThreads(error)) throw;
      throw levelset::ResourceLimit(withPlace(node.op->name + kWantOfThreads, node.place));
    }
  }

  void runNode(std::size_t index, StepReport& step, StepClock& clock) {
    const Node& node = graph_.nodes[index];
    const Operator& op = *node.op;
    Invocation invocation(op, node.options);
    if (settings_.begin) settings_.begin(op.name);
    for (const std::size_t input : node.inputs) {
      invocation.operands.push_back(values_.take(input));
      invocation.operandNames.push_back(graph_.nodes[input].name);
    }
    for (const auto& [option, input] : node.named)
      invocation.named.emplace(option, values_.take(input));
    invocation.part = demands_[index].part;
    invocation.planned = plans_[index];
    invocation.maxMemory = settings_.maxMemory;
    invocation.dryRun = settings_.dryRun;
    if (settings_.progress || settings_.goesOn) {
      invocation.progress = [&, index](double fraction) {
        if (settings_.progress) settings_.progress(index, op.name, fraction);
        return !settings_.goesOn || settings_.goesOn();
      };
    }
    const auto finish = [&] {
      step.notes = invocation.notes;
      tell(node, invocation.output, step);
    };
    try {
      if (settings_.dryRun) {
        const Plan plan = planOf(invocation);
        invocation.resolveLengths();
        levelset::requireMemory(plan.bytes(), settings_.maxMemory, op.name.c_str());
        if (node.makes()) {
          const Value value(plan);
          describeResult(value, true, step);
          if (settings_.made) settings_.made(index, value);
          values_.put(index, value);
        }
      } else {
        Value value = op.run(invocation);
        if (!demands_[index].isWhole()) value = partOf(value, demands_[index]);
        if (node.makes()) {
          describeResult(value, false, step);
          clock.stop();
          if (settings_.measureErrors) estimateError(value, invocation, invocation.notes);
        }
        clock.stop();
        keep(index, invocation, value);
        if (node.makes()) {
          if (asksThumbnail()) step.thumbnail = thumbnailOf(value, settings_.maxMemory);
          if (settings_.made) settings_.made(index, value);
          values_.put(index, std::move(value));
        }
      }
    } catch (...) {
      clock.stop();
      finish();
      throw;
    }
    finish();
  }

  /// @throws levelset::InvalidInput where there is no surface in the part
  static Value partOf(const Value& value, const Demand& demand) {
    if (value.kind() != Kind::Band) return value;
    levelset::NarrowBand part = levelset::cropped(value.band(), demand.part);
    if (part.isEmpty() && !levelset::isEverywhere(demand.part.region))
      throw levelset::InvalidInput("no surface lies in the part that is needed");
    return Value(std::move(part));
  }

  /// For the next run. What did not reach what was asked is not kept, so that it is told again.
  void keep(std::size_t i, const Invocation& invocation, const Value& value) {
    if (!cache_ || !keys_[i] || !invocation.notes.failure.empty()) return;
    const Node& node = graph_.nodes[i];
    CachedStep step{.action = node.op->name,
                    .notes = invocation.notes,
                    .output = invocation.output,
                    .files = {}};
    if (node.op->targets)
      for (const std::string& target : node.op->targets(Invocation(*node.op, node.options))) {
        const std::optional<FileStamp> file = stampOf(target);
        if (!file) return;
        step.files.push_back(*file);
      }
    const bool isHeld = node.makes() && Cache::canHold(value.kind());
    const std::string failure = cache_->put(*keys_[i], step, isHeld ? &value : nullptr);
    if (!failure.empty()) settings_.warn(failure);
  }

  const Graph& graph_;
  const RunSettings& settings_;
  RunReport& report_;
  std::vector<Fate> fates_;
  std::optional<Cache> cache_;
  std::vector<std::optional<std::string>> keys_;
  std::vector<Demand> demands_;
  std::vector<std::optional<Plan>> plans_;  // of whole values, as far as they were told ahead
  std::vector<char> wasEarly_;              // ran to be planned with
  Values values_;                           // the last: planned() fills the others
};

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
