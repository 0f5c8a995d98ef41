#include "apps/pipeline/run/graph_run.h"

#include <fmt/core.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <new>

#include "apps/pipeline/cache/cache_key.h"
#include "apps/pipeline/run/planner.h"
#include "apps/pipeline/values/refusal.h"
#include "apps/process_cost.h"
#include "levelset/error.h"
#include "levelset/placement/crop.h"

namespace pipeline {
namespace {

/// Failure of a node on a region of interest. The node may succeed on complete values.
struct RegionFailure {};

/// Decides if the input causes a failure, as opposed to memory or a cancellation.
bool isInputError(const std::exception_ptr& failure) {
  try {
    std::rethrow_exception(failure);
  } catch (const levelset::ResourceLimit&) {
    return false;
  } catch (const levelset::Cancelled&) {
    return false;
  } catch (const levelset::Error&) {
    return true;
  } catch (...) {
    return false;
  }
}

/// Largest ratio of an operator's peak memory to the size of its operands and result, from the
/// peaks of run reports.
constexpr double kWorkingFactor = 4;

/// Limit for the meshes that are read during planning, bytes.
constexpr double kMaxPlanningBytes = 1 << 28;

/// Half width, in voxels, that estimateError() reads of a band: the cells of the zero set and
/// their neighbour cells.
constexpr double kMeasuredHalfWidth = 4;

/// Crops a band to a region of interest.
/// @throws levelset::InvalidInput if the region contains no surface
Value cropTo(const Value& value, const RegionOfInterest& roi) {
  if (value.kind() != Kind::Band) return value;
  levelset::NarrowBand part = levelset::cropped(value.band(), roi);
  if (part.isEmpty() && !levelset::isEverywhere(roi.region))
    throw levelset::InvalidInput(
        "no surface lies in the region of interest; use --no-roi to compute the complete value");
  return Value(std::move(part));
}

/// Decides if a node has effects beside its value, or depends on more than its operands.
bool hasSideEffects(const Node& node) {
  const Operator& op = *node.op;
  if (!node.makes() || !op.isRepeatable) return true;
  const Invocation probe(op, node.options);
  return (op.targets && !op.targets(probe).empty()) ||
         (op.usesStandardInput && op.usesStandardInput(probe)) ||
         (op.usesStandardOutput && op.usesStandardOutput(probe));
}

}  // namespace

GraphRun::GraphRun(const Graph& graph, const RunSettings& settings, RunReport& report)
    : graph_(graph),
      settings_(settings),
      report_(report),
      threads_(std::min(
          static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()),
          tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism))),
      values_(decideStates()) {}

void GraphRun::run() {
  try {
    runNodes();
  } catch (...) {
    try {
      reportInOrder();
    } catch (const std::exception&) {
      // The first failure is the one to report.
    }
    collectSteps();
    throw;
  }
  collectSteps();
}

void GraphRun::runNodes() {
  const auto count = [&](auto... states) {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < states_.size(); ++i)
      sum += !isGiven(i) && ((states_[i] == states) || ...);
    return sum;
  };
  const std::size_t known = count(NodeState::Load, NodeState::UpToDate),
                    ran = count(NodeState::Compute);
  planNodes();
  for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
    const Node& node = graph_.nodes[i];
    if (states_[i] == NodeState::Unneeded)
      report_.leftOut.push_back(node.op->name + (node.name.empty() ? "" : " @" + node.name));
    else if (const auto given = graph_.given.find(i); given != graph_.given.end())
      values_.put(i, given->second);
  }
  const std::size_t all = graph_.nodes.size();
  ScheduleResult done{.isDone = std::vector<char>(all, 0)};
  if (threads_ > 1 && !settings_.dryRun && hasBranches()) done = scheduleTasks();
  runInOrder(done.isDone, done.failed.value_or(all));
  if (done.failure) std::rethrow_exception(done.failure);
  if (known > 0)
    settings_.note(
        ran == 0
            ? fmt::format("nothing was computed: all {} results come from an earlier run", known)
            : fmt::format("{} of {} results come from an earlier run", known, known + ran));
}

void GraphRun::runInOrder(const std::vector<char>& isDone, std::size_t end) {
  for (std::size_t i = 0; i < end; ++i) {
    reportInOrder();
    if (isDone[i] || isComputedForPlan_[i] || isGiven(i) || states_[i] == NodeState::Unneeded)
      continue;
    if (needsFullValues_[i]) requestFullValues(i);
    if (needsFullValues_[i] || states_[i] == NodeState::Compute)
      compute(i);
    else
      loadFromCache(i);
  }
  reportInOrder();
}

/// Sets the state of each node.
/// @return for each node, the number of nodes that run and take its value
std::vector<std::size_t> GraphRun::decideStates() {
  const std::size_t count = graph_.nodes.size();
  const std::vector<char> needed = neededNodes(graph_);
  isComputedForPlan_.resize(count);
  planningFailures_.resize(count);
  needsFullValues_.resize(count);
  regions_.resize(count);
  plans_.resize(count);
  steps_.resize(count);
  pendingOutput_.resize(count);
  states_.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    states_[i] = needed[i] ? NodeState::Compute : NodeState::Unneeded;
  if (!settings_.cache.empty() && !settings_.dryRun) useCache(needed);
  std::vector<char> runs(count);
  for (std::size_t i = 0; i < count; ++i) runs[i] = states_[i] == NodeState::Compute;
  return countUses(graph_, runs);
}

void GraphRun::useCache(const std::vector<char>& needed) {
  cache_.emplace(settings_.cache);
  keys_ = CacheKeys(*cache_, settings_.maxMemory).of(graph_, needed);
  const std::vector<std::size_t> uses = countUses(graph_, needed);
  std::vector<char> taken(graph_.nodes.size(), 0);
  for (const std::size_t result : graph_.results) taken[result] = 1;
  for (std::size_t i = graph_.nodes.size(); i-- > 0;) {
    const Node& node = graph_.nodes[i];
    if (!needed[i]) continue;
    const bool isKnown = keys_[i] && cache_->has(*keys_[i]);
    if (!node.makes()) {
      if (isKnown && isUpToDate(*keys_[i])) states_[i] = NodeState::UpToDate;
    } else if (!taken[i] && uses[i] > 0) {  // a value without consumers is a result of its own
      states_[i] = NodeState::UpToDate;
    } else if (isKnown && Cache::canHold(node.kind)) {
      states_[i] = NodeState::Load;
    }
    if (states_[i] != NodeState::Compute) continue;
    for (const std::size_t input : node.inputs) taken[input] = 1;
    for (const auto& [option, input] : node.named) taken[input] = 1;
  }
}

/// Decides if the files that a cached step wrote are unchanged.
bool GraphRun::isUpToDate(const std::string& key) const {
  const std::optional<CachedStep> step = cache_->step(key);
  return step && std::all_of(step->files.begin(), step->files.end(),
                             [](const FileStamp& file) { return stampOf(file.path) == file; });
}

/// Estimates the size of each value and finds its region of interest. Values that may be requested
/// again later, from the cache or from Python, stay complete.
void GraphRun::planNodes() {
  std::vector<char> runs(graph_.nodes.size());
  for (std::size_t i = 0; i < runs.size(); ++i) runs[i] = states_[i] == NodeState::Compute;
  if (settings_.dryRun) return;
  plans_ = planValues(graph_, runs, settings_.maxMemory, [&](std::size_t i) {
             return planFromMesh(i);
           }).plans;
  if (!settings_.fullValues && !cache_ && !settings_.onValue)
    regions_ =
        regionsOfInterest(graph_, runs, plans_, settings_.measureErrors ? kMeasuredHalfWidth : 1);
  if (std::any_of(regions_.begin(), regions_.end(),
                  [](const RegionOfInterest& roi) { return !roi.isWhole(); })) {
    const std::vector<char> isOverwritten = findOverwritten(graph_, runs);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (!runs[i] || !(isOverwritten[i] || readsOnce(graph_.nodes[i]))) continue;
      // The node cannot be read again: keep its complete value for a retry on complete values.
      regions_[i] = {};
      values_.addUse(i);
    }
  }
  checkMemoryFor(graph_, runs, plans_, regions_, settings_.maxMemory);
}

/// Computes a mesh during planning if a band is computed from it. The plan of a mesh requires the
/// mesh itself. Does nothing when the meshes held already exceed the limit.
std::optional<Plan> GraphRun::planFromMesh(std::size_t i) {
  const double most = std::min(kMaxPlanningBytes, static_cast<double>(settings_.maxMemory) / 8);
  const bool feedsBand = std::any_of(graph_.nodes.begin() + static_cast<std::ptrdiff_t>(i),
                                     graph_.nodes.end(), [&](const Node& node) {
                                       return node.makes() && node.kind == Kind::Band &&
                                              std::find(node.inputs.begin(), node.inputs.end(),
                                                        i) != node.inputs.end();
                                     });
  if (!feedsBand || planningBytes_ > most) return {};
  const std::size_t endBefore = reportEnd_;
  try {
    compute(i);
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (const levelset::Error&) {
    planningFailures_[i] = std::current_exception();  // rethrown when the node's turn comes
    states_[i] = NodeState::Compute;
    reportEnd_ = std::min(endBefore, i + 1);
    return {};
  }
  isComputedForPlan_[i] = 1;
  if (!values_.has(i)) return {};
  const levelset::TriMesh& mesh = values_.peek(i).mesh();
  planningBytes_ += static_cast<double>(mesh.positions.size() * sizeof(mesh.positions[0]) +
                                        mesh.triangles.size() * sizeof(mesh.triangles[0]));
  return values_.peek(i).plan();
}

/// Decides if the result or an operand of a node is restricted to a region of interest.
bool GraphRun::isRestricted(std::size_t i) const {
  const std::vector<std::size_t>& inputs = graph_.nodes[i].inputs;
  return !regions_[i].isWhole() ||
         std::any_of(inputs.begin(), inputs.end(),
                     [&](std::size_t input) { return !regions_[input].isWhole(); });
}

/// Removes the region of interest from a node and from all nodes that it depends on.
void GraphRun::requestFullValues(std::size_t i) {
  std::vector<char> isRequested(i + 1, 0);
  isRequested[i] = 1;
  for (std::size_t k = i + 1; k-- > 0;) {
    if (!isRequested[k]) continue;
    regions_[k] = {};
    for (const std::size_t input : graph_.nodes[k].inputs) {
      if (!regions_[input].isWhole()) values_.drop(input);
      isRequested[input] = 1;
    }
  }
}

/// Decides if any node can run concurrently with the node before it.
bool GraphRun::hasBranches() const {
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
    if (states_[i] == NodeState::Unneeded || isGiven(i)) continue;
    const Node& node = graph_.nodes[i];
    const auto& inputs = node.inputs;
    const bool takesPrevious =
        before && std::find(inputs.begin(), inputs.end(), *before) != inputs.end();
    if (before && !takesPrevious && !hasSideEffects(node)) return true;
    before = i;
  }
  return false;
}

std::vector<Task> GraphRun::tasks() const {
  std::vector<char> needed(graph_.nodes.size());
  for (std::size_t i = 0; i < needed.size(); ++i) needed[i] = states_[i] != NodeState::Unneeded;
  const auto writers = findWritersRead(graph_, needed);
  std::vector<Task> tasks(graph_.nodes.size());
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (!needed[i] || isGiven(i)) continue;
    const Node& node = graph_.nodes[i];
    tasks[i].isBarrier = hasSideEffects(node);
    if (writers[i]) tasks[i].dependencies.push_back(*writers[i]);
    if (states_[i] != NodeState::Compute) continue;
    for (const std::size_t input : node.inputs) tasks[i].dependencies.push_back(input);
    for (const auto& [option, input] : node.named) tasks[i].dependencies.push_back(input);
  }
  return tasks;
}

ScheduleResult GraphRun::scheduleTasks() {
  SchedulerSettings settings{.threads = threads_};
  settings.run = [&](std::size_t i, const ContinueCheck& shouldContinue) {
    const bool isDone = runTask(i, shouldContinue);
    const std::lock_guard lock(mutex_);
    if (isDone) reportInOrder();
    return isDone;
  };
  settings.mayStart = [&](std::size_t i, const std::vector<std::size_t>& running) {
    const std::lock_guard lock(mutex_);
    return fitsInMemory(i, running);
  };
  return pipeline::scheduleTasks(tasks(), settings);
}

/// Runs a node as a task of the scheduler.
/// @return false: the node must run later, without concurrent tasks
bool GraphRun::runTask(std::size_t i, const ContinueCheck& shouldContinue) {
  NodeState state = NodeState::Unneeded;
  {
    const std::lock_guard lock(mutex_);
    state = states_[i];
    if (state == NodeState::Unneeded || isComputedForPlan_[i] || isGiven(i)) return true;
    const Node& node = graph_.nodes[i];
    const auto isAvailable = [&](std::size_t input) { return values_.has(input); };
    if (state == NodeState::Compute &&
        !(std::all_of(node.inputs.begin(), node.inputs.end(), isAvailable) &&
          std::all_of(node.named.begin(), node.named.end(),
                      [&](const auto& named) { return isAvailable(named.second); })))
      return false;
    if (state == NodeState::Compute) states_[i] = NodeState::UpToDate;
  }
  if (state != NodeState::Compute) return tryLoad(i);
  tbb::task_arena arena(static_cast<int>(threads_));
  const ArenaCpu cpu(arena);
  try {
    arena.execute([&] { runChecked(i, shouldContinue, &cpu); });
  } catch (const RegionFailure&) {
    const std::lock_guard lock(mutex_);
    needsFullValues_[i] = 1;
    return false;
  }
  return true;
}

/// Decides, from memory estimates, if a node fits into memory beside the running ones.
bool GraphRun::fitsInMemory(std::size_t i, const std::vector<std::size_t>& running) const {
  if (!isLimited()) return true;
  const std::optional<double> own = workingBytes(i);
  if (!own) return false;
  double bytes = apps::processStatusBytes("VmRSS:") + *own;
  for (const std::size_t other : running) {
    const std::optional<double> of = workingBytes(other);
    if (!of) return false;
    bytes += *of;
  }
  // The estimates are rough: leave half of the limit free.
  return bytes <= static_cast<double>(settings_.maxMemory) / 2;
}

/// Estimates the memory that a node takes while it runs, bytes; empty: unknown.
std::optional<double> GraphRun::workingBytes(std::size_t i) const {
  if (isGiven(i) || states_[i] == NodeState::Unneeded || isComputedForPlan_[i]) return 0;
  const Node& node = graph_.nodes[i];
  double bytes = 0;
  const auto add = [&](std::size_t of) {
    if (!plans_[of]) return false;
    bytes += kWorkingFactor * restricted(*plans_[of], regions_[of]).bytes();
    return true;
  };
  if (node.makes() && !add(i)) return {};
  if (!std::all_of(node.inputs.begin(), node.inputs.end(), add)) return {};
  for (const auto& [option, input] : node.named)
    if (!add(input)) return {};
  return bytes;
}

StepReport& GraphRun::begin(std::size_t i) {
  const Node& node = graph_.nodes[i];
  StepReport step;
  if (steps_[i]) {  // a repeated step: its costs add up
    step.wallSeconds = steps_[i]->wallSeconds;
    step.cpuSeconds = steps_[i]->cpuSeconds;
    step.peakBytes = steps_[i]->peakBytes;
  }
  step.action = node.op->name;
  step.parameters = node.options;
  for (const Param& param : node.op->params)
    if (!param.fallback.empty() && !node.options.contains(param.name))
      step.defaults[param.name] = param.fallback;
  step.resultName = node.name;
  step.location = node.location;
  step.roi = regions_[i];
  return steps_[i].emplace(std::move(step));
}

void GraphRun::collectSteps() {
  for (std::size_t i = 0; i < std::min(steps_.size(), reportEnd_); ++i)
    if (steps_[i]) report_.steps.push_back(std::move(*steps_[i]));
}

Thumbnail GraphRun::thumbnailFor(std::size_t i, const Value& value) {
  if (settings_.thumbnails == 0) return {};
  if (i >= settings_.thumbnails)
    return {
        .png = {},
        .missing = fmt::format("only the first {} actions get a thumbnail", settings_.thumbnails)};
  Thumbnail thumbnail = thumbnailOf(value, settings_.maxMemory);
  running_.resetPeak();
  return thumbnail;
}

/// Stores the printed text of a finished node until its turn to be reported.
void GraphRun::queueOutput(std::size_t i, const std::string& output) {
  pendingOutput_[i] = output;
}

/// Reports finished nodes in the order of the graph, independent of which one ended first.
void GraphRun::reportInOrder() {
  for (; nextReported_ < std::min(states_.size(), reportEnd_); ++nextReported_) {
    const std::size_t i = nextReported_;
    if (isGiven(i) || states_[i] == NodeState::Unneeded) continue;
    if (!pendingOutput_[i]) return;
    const Node& node = graph_.nodes[i];
    StepNotes& notes = steps_[i]->notes;
    try {
      if (!pendingOutput_[i]->empty() && settings_.print) settings_.print(*pendingOutput_[i]);
    } catch (const levelset::Error& error) {
      rethrowAs(node.op->name, error, node.location);
    }
    for (const std::string& text : notes.warnings)
      settings_.warn(withLocation(sentenceOf(node.op->name, text), node.location));
    for (const std::string& text : notes.notes) settings_.note(sentenceOf(node.op->name, text));
    // The failure is thrown after the run, and the report lists it as a warning of its step.
    if (!notes.failure.empty()) notes.warnings.push_back(notes.failure);
  }
}

/// Repeats the cached output of a node and loads its value if a node takes it.
void GraphRun::loadFromCache(std::size_t i) {
  if (!tryLoad(i)) compute(i);
}

/// @return false: the cache entry is damaged
bool GraphRun::tryLoad(std::size_t i) {
  std::optional<Value> value;
  if (states_[i] == NodeState::Load) {
    value = cache_->value(*keys_[i], settings_.maxMemory);
    if (!value) return false;
  }
  Thumbnail thumbnail;
  if (value) thumbnail = thumbnailFor(i, *value);
  const std::lock_guard lock(mutex_);
  StepReport& step = begin(i);
  step.isCached = true;
  step.thumbnail = std::move(thumbnail);
  std::string output;
  if (keys_[i])
    if (std::optional<CachedStep> known = cache_->step(*keys_[i])) {
      step.notes = std::move(known->notes);
      output = std::move(known->output);
    }
  if (value) {
    describeResult(*value, false, step);
    if (settings_.onValue) settings_.onValue(i, *value);
    values_.put(i, std::move(*value));
  }
  queueOutput(i, output);
  return true;
}

/// Computes a node. Computes or loads its operands first if they are missing, as they are after a
/// damaged cache entry.
void GraphRun::compute(std::size_t i) {
  if (isGiven(i)) return values_.put(i, graph_.given.at(i));
  const Node& node = graph_.nodes[i];
  const bool isPlanned =
      states_[i] == NodeState::Compute;  // the uses of its operands are already counted
  states_[i] = NodeState::UpToDate;      // a later request for a released value loads it
  if (!isPlanned) {
    for (const std::size_t input : node.inputs) values_.addUse(input);
    for (const auto& [option, input] : node.named) values_.addUse(input);
  }
  const auto bring = [&](std::size_t input) {
    if (values_.has(input)) return;
    if (cache_ && states_[input] == NodeState::UpToDate && keys_[input] &&
        Cache::canHold(graph_.nodes[input].kind) && cache_->has(*keys_[input]))
      states_[input] = NodeState::Load;
    if (states_[input] == NodeState::Load)
      loadFromCache(input);
    else
      compute(input);
  };
  for (const std::size_t input : node.inputs) bring(input);
  for (const auto& [option, input] : node.named) bring(input);
  try {
    runChecked(i, {}, nullptr);
  } catch (const RegionFailure&) {
    requestFullValues(i);
    compute(i);  // counts the uses of its operands again
  }
}

void GraphRun::runChecked(std::size_t i, const ContinueCheck& shouldContinue,
                          const ArenaCpu* arena) {
  const Node& node = graph_.nodes[i];
  if (planningFailures_[i]) {
    const std::lock_guard lock(mutex_);
    reportEnd_ = std::min(reportEnd_, i + 1);
    std::rethrow_exception(planningFailures_[i]);
  }
  StepReport& step = begin(i);
  StepClock clock(step, running_, arena);
  try {
    runNode(i, step, clock, shouldContinue);
  } catch (const std::bad_alloc&) {
    throw levelset::ResourceLimit(withLocation(
        node.op->name + ": memory ran out; use larger voxels or a narrower band", node.location));
  } catch (const levelset::Error& error) {
    rethrowAs(node.op->name, error, node.location);
  } catch (const std::exception& error) {
    if (!isThreadLimitError(error)) throw;
    throw levelset::ResourceLimit(withLocation(node.op->name + kThreadLimitMessage, node.location));
  }
}

Invocation GraphRun::invocationOf(std::size_t i, const ContinueCheck& shouldContinue) {
  const Node& node = graph_.nodes[i];
  Invocation invocation(*node.op, node.options);
  const std::lock_guard lock(mutex_);
  if (settings_.begin) settings_.begin(node.op->name);
  for (const std::size_t input : node.inputs) {
    invocation.operands.push_back(values_.take(input));
    invocation.operandNames.push_back(graph_.nodes[input].name);
  }
  for (const auto& [option, input] : node.named)
    invocation.named.emplace(option, values_.take(input));
  invocation.roi = regions_[i];
  invocation.planned = plans_[i];
  invocation.isPartial = !node.inputs.empty() && std::isfinite(regions_[node.inputs[0]].halfWidth);
  invocation.maxMemory = settings_.maxMemory;
  invocation.dryRun = settings_.dryRun;
  if (settings_.progress || settings_.shouldContinue || shouldContinue)
    invocation.progress = [this, i, &node, shouldContinue](double fraction) {
      if (settings_.progress) settings_.progress(i, node.op->name, fraction);
      return (!shouldContinue || shouldContinue()) &&
             (!settings_.shouldContinue || settings_.shouldContinue());
    };
  return invocation;
}

/// Runs the operator of a node, or its plan in a dry run.
/// @throws RegionFailure if the node may succeed on complete values; otherwise the operator's error
void GraphRun::runNode(std::size_t i, StepReport& step, StepClock& clock,
                       const ContinueCheck& shouldContinue) {
  const Node& node = graph_.nodes[i];
  const Operator& op = *node.op;
  Invocation invocation = invocationOf(i, shouldContinue);
  const auto finish = [&](const Value* value, bool isRefused = false) {
    const std::lock_guard lock(mutex_);
    if (isRefused) reportEnd_ = std::min(reportEnd_, i + 1);
    if (value && settings_.onValue) settings_.onValue(i, *value);
    if (value) values_.put(i, *value);
    step.notes = invocation.notes;
    queueOutput(i, invocation.output);
  };
  try {
    if (settings_.dryRun) {
      const Plan plan = planOf(invocation);
      invocation.resolveLengths();
      levelset::requireMemory(plan.bytes(), settings_.maxMemory, op.name.c_str());
      const Value value(plan);
      if (node.makes()) describeResult(value, true, step);
      clock.stop();
      finish(node.makes() ? &value : nullptr);
    } else {
      Value value = op.run(invocation);
      if (!regions_[i].isWhole()) value = cropTo(value, regions_[i]);
      if (node.makes()) describeResult(value, false, step);
      clock.stop();
      if (node.makes() && settings_.measureErrors)
        estimateError(value, invocation, invocation.notes);
      storeInCache(i, invocation, value);
      if (node.makes()) step.thumbnail = thumbnailFor(i, value);
      finish(node.makes() ? &value : nullptr);
    }
  } catch (...) {
    clock.stop();
    if (isRestricted(i) && isInputError(std::current_exception())) throw RegionFailure();
    finish(nullptr, true);
    throw;
  }
}

/// Stores a result for later runs. Does not store a failed one, so that the failure is reported
/// again.
void GraphRun::storeInCache(std::size_t i, const Invocation& invocation, const Value& value) {
  if (!cache_ || !keys_[i] || !invocation.notes.failure.empty()) return;
  const Node& node = graph_.nodes[i];
  CachedStep step{
      .action = node.op->name, .notes = invocation.notes, .output = invocation.output, .files = {}};
  if (node.op->targets)
    for (const std::string& target : node.op->targets(Invocation(*node.op, node.options))) {
      const std::optional<FileStamp> file = stampOf(target);
      if (!file) return;
      step.files.push_back(*file);
    }
  const bool isHeld = node.makes() && Cache::canHold(value.kind());
  const std::string failure = cache_->put(*keys_[i], step, isHeld ? &value : nullptr);
  if (failure.empty()) return;
  const std::lock_guard lock(mutex_);
  settings_.warn(failure);
}

}  // namespace pipeline
