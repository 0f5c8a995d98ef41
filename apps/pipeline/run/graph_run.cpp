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

/// Of a part; of the whole it may be something else.
struct RefusedInPart {};

/// Is it about what was given, rather than about memory or an end that was asked for?
bool isOfInput(const std::exception_ptr& failure) {
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

/// Operators hold this many times what they take or make, at most, by the report's peaks.
constexpr double kWorkingSpace = 4;

/// Of meshes that are read to be planned with.
constexpr double kMostEarlyBytes = 1 << 28;

/// Voxels: what estimateError() reads of a band, up to the corners of cells beside those of the
/// zero set.
constexpr double kMeasuredHalfWidth = 4;

/// @throws levelset::InvalidInput where there is no surface in the part
Value partOf(const Value& value, const RegionOfInterest& roi) {
  if (value.kind() != Kind::Band) return value;
  levelset::NarrowBand part = levelset::cropped(value.band(), roi);
  if (part.isEmpty() && !levelset::isEverywhere(roi.region))
    throw levelset::InvalidInput("no surface lies in the part that is needed");
  return Value(std::move(part));
}

/// Does it leave something behind beside its value, or look at what is outside?
bool isOrdered(const Node& node) {
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
      tellInOrder();
    } catch (const std::exception&) {
      // What went wrong first is what the user must hear.
    }
    fileSteps();
    throw;
  }
  fileSteps();
}

void GraphRun::runNodes() {
  const auto count = [&](auto... fates) {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < states_.size(); ++i)
      sum += !isGiven(i) && ((states_[i] == fates) || ...);
    return sum;
  };
  const std::size_t known = count(NodeState::Load, NodeState::Known), ran = count(NodeState::Run);
  planAhead();
  for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
    const Node& node = graph_.nodes[i];
    if (states_[i] == NodeState::LeftOut)
      report_.leftOut.push_back(node.op->name + (node.name.empty() ? "" : " @" + node.name));
    else if (const auto given = graph_.given.find(i); given != graph_.given.end())
      values_.put(i, given->second);
  }
  const std::size_t all = graph_.nodes.size();
  JobsDone done{.isDone = std::vector<char>(all, 0)};
  if (threads_ > 1 && !settings_.dryRun && isBranched()) done = scheduleTasks();
  runInOrder(done.isDone, done.failed.value_or(all));
  if (done.failure) std::rethrow_exception(done.failure);
  if (known > 0)
    settings_.note(
        ran == 0 ? fmt::format("nothing was computed: all {} results are of an earlier run", known)
                 : fmt::format("{} of {} results are of an earlier run", known, known + ran));
}

void GraphRun::runInOrder(const std::vector<char>& isDone, std::size_t end) {
  for (std::size_t i = 0; i < end; ++i) {
    tellInOrder();
    if (isDone[i] || wasEarly_[i] || isGiven(i) || states_[i] == NodeState::LeftOut) continue;
    if (isRefused_[i]) makeWhole(i);
    if (isRefused_[i] || states_[i] == NodeState::Run)
      compute(i);
    else
      recall(i);
  }
  tellInOrder();
}

/// @return by node: how many that run take its value
std::vector<std::size_t> GraphRun::decideStates() {
  const std::size_t count = graph_.nodes.size();
  const std::vector<char> needed = neededNodes(graph_);
  wasEarly_.resize(count);
  earlyFailures_.resize(count);
  isRefused_.resize(count);
  regions_.resize(count);
  plans_.resize(count);
  steps_.resize(count);
  unspoken_.resize(count);
  states_.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    states_[i] = needed[i] ? NodeState::Run : NodeState::LeftOut;
  if (!settings_.cache.empty() && !settings_.dryRun) useCache(needed);
  std::vector<char> runs(count);
  for (std::size_t i = 0; i < count; ++i) runs[i] = states_[i] == NodeState::Run;
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
      if (isKnown && isUpToDate(*keys_[i])) states_[i] = NodeState::Known;
    } else if (!taken[i] && uses[i] > 0) {  // what ends a chain is made for itself
      states_[i] = NodeState::Known;
    } else if (isKnown && Cache::canHold(node.kind)) {
      states_[i] = NodeState::Load;
    }
    if (states_[i] != NodeState::Run) continue;
    for (const std::size_t input : node.inputs) taken[input] = 1;
    for (const auto& [option, input] : node.named) taken[input] = 1;
  }
}

/// Are the files there as they were left?
bool GraphRun::isUpToDate(const std::string& key) const {
  const std::optional<CachedStep> step = cache_->step(key);
  return step && std::all_of(step->files.begin(), step->files.end(),
                             [](const FileStamp& file) { return stampOf(file.path) == file; });
}

/// Finds how large values are, and how much of each is needed, so that no more is made. Values that
/// others may ask for later, out of a cache or of Python, are whole.
void GraphRun::planAhead() {
  std::vector<char> runs(graph_.nodes.size());
  for (std::size_t i = 0; i < runs.size(); ++i) runs[i] = states_[i] == NodeState::Run;
  if (settings_.dryRun) return;
  plans_ =
      plansOf(graph_, runs, settings_.maxMemory, [&](std::size_t i) { return planEarly(i); }).plans;
  if (!settings_.wholeValues && !cache_ && !settings_.made)
    regions_ =
        regionsOfInterest(graph_, runs, plans_, settings_.measureErrors ? kMeasuredHalfWidth : 1);
  if (std::any_of(regions_.begin(), regions_.end(),
                  [](const RegionOfInterest& roi) { return !roi.isWhole(); })) {
    const std::vector<char> isOverwritten = findOverwritten(graph_, runs);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (!runs[i] || !(isOverwritten[i] || readsOnce(graph_.nodes[i]))) continue;
      // It is there to be taken once more, where a part turns out not to do.
      regions_[i] = {};
      values_.addUse(i);
    }
  }
  requireMemoryFor(graph_, runs, plans_, regions_, settings_.maxMemory);
}

/// To plan a mesh is to read it: so it is made now where a band is made of it, unless many are held
/// already.
std::optional<Plan> GraphRun::planEarly(std::size_t i) {
  const double most = std::min(kMostEarlyBytes, static_cast<double>(settings_.maxMemory) / 8);
  const bool makesBand = std::any_of(graph_.nodes.begin() + static_cast<std::ptrdiff_t>(i),
                                     graph_.nodes.end(), [&](const Node& node) {
                                       return node.makes() && node.kind == Kind::Band &&
                                              std::find(node.inputs.begin(), node.inputs.end(),
                                                        i) != node.inputs.end();
                                     });
  if (!makesBand || earlyBytes_ > most) return {};
  const std::size_t toldBefore = tellEnd_;
  try {
    compute(i);
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (const levelset::Error&) {
    earlyFailures_[i] = std::current_exception();  // thrown in its turn
    states_[i] = NodeState::Run;
    tellEnd_ = std::min(toldBefore, i + 1);
    return {};
  }
  wasEarly_[i] = 1;
  if (!values_.has(i)) return {};
  const levelset::TriMesh& mesh = values_.peek(i).mesh();
  earlyBytes_ += static_cast<double>(mesh.positions.size() * sizeof(mesh.positions[0]) +
                                     mesh.triangles.size() * sizeof(mesh.triangles[0]));
  return values_.peek(i).plan();
}

/// Did it take or make less than the whole?
bool GraphRun::isPartial(std::size_t i) const {
  const std::vector<std::size_t>& inputs = graph_.nodes[i].inputs;
  return !regions_[i].isWhole() ||
         std::any_of(inputs.begin(), inputs.end(),
                     [&](std::size_t input) { return !regions_[input].isWhole(); });
}

/// From now on it and all that it is made of are whole.
void GraphRun::makeWhole(std::size_t i) {
  std::vector<char> isAsked(i + 1, 0);
  isAsked[i] = 1;
  for (std::size_t k = i + 1; k-- > 0;) {
    if (!isAsked[k]) continue;
    regions_[k] = {};
    for (const std::size_t input : graph_.nodes[k].inputs) {
      if (!regions_[input].isWhole()) values_.drop(input);
      isAsked[input] = 1;
    }
  }
}

/// Is there one that runs and does not wait for what runs before it?
bool GraphRun::isBranched() const {
  std::optional<std::size_t> before;
  for (std::size_t i = 0; i < graph_.nodes.size(); ++i) {
    if (states_[i] == NodeState::LeftOut || isGiven(i)) continue;
    const Node& node = graph_.nodes[i];
    const auto& inputs = node.inputs;
    const bool takesIt = before && std::find(inputs.begin(), inputs.end(), *before) != inputs.end();
    if (before && !takesIt && !isOrdered(node)) return true;
    before = i;
  }
  return false;
}

std::vector<Job> GraphRun::jobs() const {
  std::vector<char> needed(graph_.nodes.size());
  for (std::size_t i = 0; i < needed.size(); ++i) needed[i] = states_[i] != NodeState::LeftOut;
  const auto writers = findWritersRead(graph_, needed);
  std::vector<Job> jobs(graph_.nodes.size());
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    if (!needed[i] || isGiven(i)) continue;
    const Node& node = graph_.nodes[i];
    jobs[i].waitsForAll = isOrdered(node);
    if (writers[i]) jobs[i].waitsFor.push_back(*writers[i]);
    if (states_[i] != NodeState::Run) continue;
    for (const std::size_t input : node.inputs) jobs[i].waitsFor.push_back(input);
    for (const auto& [option, input] : node.named) jobs[i].waitsFor.push_back(input);
  }
  return jobs;
}

JobsDone GraphRun::scheduleTasks() {
  JobSettings settings{.threads = threads_};
  settings.run = [&](std::size_t i, const GoesOn& goesOn) {
    const bool isDone = runBeside(i, goesOn);
    const std::lock_guard lock(mutex_);
    if (isDone) tellInOrder();
    return isDone;
  };
  settings.mayJoin = [&](std::size_t i, const std::vector<std::size_t>& running) {
    const std::lock_guard lock(mutex_);
    return fitsBeside(i, running);
  };
  return pipeline::scheduleTasks(jobs(), settings);
}

/// @return false: it has to be done without others beside it
bool GraphRun::runBeside(std::size_t i, const GoesOn& goesOn) {
  NodeState fate = NodeState::LeftOut;
  {
    const std::lock_guard lock(mutex_);
    fate = states_[i];
    if (fate == NodeState::LeftOut || wasEarly_[i] || isGiven(i)) return true;
    const Node& node = graph_.nodes[i];
    const auto isThere = [&](std::size_t input) { return values_.has(input); };
    if (fate == NodeState::Run &&
        !(std::all_of(node.inputs.begin(), node.inputs.end(), isThere) &&
          std::all_of(node.named.begin(), node.named.end(),
                      [&](const auto& named) { return isThere(named.second); })))
      return false;
    if (fate == NodeState::Run) states_[i] = NodeState::Known;
  }
  if (fate != NodeState::Run) return recallValue(i);
  tbb::task_arena arena(static_cast<int>(threads_));
  const ArenaCpu cpu(arena);
  try {
    arena.execute([&] { attempt(i, goesOn, &cpu); });
  } catch (const RefusedInPart&) {
    const std::lock_guard lock(mutex_);
    isRefused_[i] = 1;
    return false;
  }
  return true;
}

/// Is there memory for it beside those that run, as far as can be told?
bool GraphRun::fitsBeside(std::size_t i, const std::vector<std::size_t>& running) const {
  if (!isLimited()) return true;
  const std::optional<double> own = workBytes(i);
  if (!own) return false;
  double bytes = apps::processStatusBytes("VmRSS:") + *own;
  for (const std::size_t other : running) {
    const std::optional<double> of = workBytes(other);
    if (!of) return false;
    bytes += *of;
  }
  // What runs is not told to the byte: half is left.
  return bytes <= static_cast<double>(settings_.maxMemory) / 2;
}

/// Empty: nobody knows.
std::optional<double> GraphRun::workBytes(std::size_t i) const {
  if (isGiven(i) || states_[i] == NodeState::LeftOut || wasEarly_[i]) return 0;
  const Node& node = graph_.nodes[i];
  double bytes = 0;
  const auto add = [&](std::size_t of) {
    if (!plans_[of]) return false;
    bytes += kWorkingSpace * restricted(*plans_[of], regions_[of]).bytes();
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
  if (steps_[i]) {  // it is made again, and took what it took before, too
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
  step.place = node.place;
  step.needed = regions_[i];
  return steps_[i].emplace(std::move(step));
}

void GraphRun::fileSteps() {
  for (std::size_t i = 0; i < std::min(steps_.size(), tellEnd_); ++i)
    if (steps_[i]) report_.steps.push_back(std::move(*steps_[i]));
}

Thumbnail GraphRun::thumbnailFor(std::size_t i, const Value& value) {
  if (settings_.thumbnails == 0) return {};
  if (i >= settings_.thumbnails)
    return {.png = {},
            .missing = fmt::format("only the first {} actions have one", settings_.thumbnails)};
  Thumbnail thumbnail = thumbnailOf(value, settings_.maxMemory);
  running_.forgetPeak();
  return thumbnail;
}

/// To be told in its turn.
void GraphRun::tell(std::size_t i, const std::string& output) {
  unspoken_[i] = output;
}

/// What comes first in the graph is told first, whatever ended first.
void GraphRun::tellInOrder() {
  for (; nextTold_ < std::min(states_.size(), tellEnd_); ++nextTold_) {
    const std::size_t i = nextTold_;
    if (isGiven(i) || states_[i] == NodeState::LeftOut) continue;
    if (!unspoken_[i]) return;
    const Node& node = graph_.nodes[i];
    StepNotes& notes = steps_[i]->notes;
    try {
      if (!unspoken_[i]->empty() && settings_.print) settings_.print(*unspoken_[i]);
    } catch (const levelset::Error& error) {
      refuseAs(node.op->name, error, node.place);
    }
    for (const std::string& text : notes.warnings)
      settings_.warn(withPlace(sentenceOf(node.op->name, text), node.place));
    for (const std::string& text : notes.notes) settings_.note(sentenceOf(node.op->name, text));
    // Told at the end, and by the report where it belongs.
    if (!notes.failure.empty()) notes.warnings.push_back(notes.failure);
  }
}

/// What is known of a node is told again, and its value brought where one is taken.
void GraphRun::recall(std::size_t i) {
  if (!recallValue(i)) compute(i);
}

/// @return false: its entry is damaged
bool GraphRun::recallValue(std::size_t i) {
  std::optional<Value> value;
  if (states_[i] == NodeState::Load) {
    value = cache_->value(*keys_[i], settings_.maxMemory);
    if (!value) return false;
  }
  Thumbnail thumbnail;
  if (value) thumbnail = thumbnailFor(i, *value);
  const std::lock_guard lock(mutex_);
  StepReport& step = begin(i);
  step.isKnown = true;
  step.thumbnail = std::move(thumbnail);
  std::string output;
  if (keys_[i])
    if (std::optional<CachedStep> known = cache_->step(*keys_[i])) {
      step.notes = std::move(known->notes);
      output = std::move(known->output);
    }
  if (value) {
    describeResult(*value, false, step);
    if (settings_.made) settings_.made(i, *value);
    values_.put(i, std::move(*value));
  }
  tell(i, output);
  return true;
}

/// Also where an entry of the cache was damaged, and what it was made of has to be made again.
void GraphRun::compute(std::size_t i) {
  if (isGiven(i)) return values_.put(i, graph_.given.at(i));
  const Node& node = graph_.nodes[i];
  const bool isPlanned = states_[i] == NodeState::Run;  // its uses of others are counted
  states_[i] = NodeState::Known;  // to those who may ask for it again, once its value was let go
  if (!isPlanned) {
    for (const std::size_t input : node.inputs) values_.addUse(input);
    for (const auto& [option, input] : node.named) values_.addUse(input);
  }
  const auto bring = [&](std::size_t input) {
    if (values_.has(input)) return;
    if (cache_ && states_[input] == NodeState::Known && keys_[input] &&
        Cache::canHold(graph_.nodes[input].kind) && cache_->has(*keys_[input]))
      states_[input] = NodeState::Load;
    if (states_[input] == NodeState::Load)
      recall(input);
    else
      compute(input);
  };
  for (const std::size_t input : node.inputs) bring(input);
  for (const auto& [option, input] : node.named) bring(input);
  try {
    attempt(i, {}, nullptr);
  } catch (const RefusedInPart&) {
    makeWhole(i);
    compute(i);  // its uses of others are counted again
  }
}

void GraphRun::attempt(std::size_t i, const GoesOn& goesOn, const ArenaCpu* arena) {
  const Node& node = graph_.nodes[i];
  if (earlyFailures_[i]) {
    const std::lock_guard lock(mutex_);
    tellEnd_ = std::min(tellEnd_, i + 1);
    std::rethrow_exception(earlyFailures_[i]);
  }
  StepReport& step = begin(i);
  StepClock clock(step, running_, arena);
  try {
    runNode(i, step, clock, goesOn);
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

Invocation GraphRun::invocationOf(std::size_t i, const GoesOn& goesOn) {
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
  if (settings_.progress || settings_.goesOn || goesOn)
    invocation.progress = [this, i, &node, goesOn](double fraction) {
      if (settings_.progress) settings_.progress(i, node.op->name, fraction);
      return (!goesOn || goesOn()) && (!settings_.goesOn || settings_.goesOn());
    };
  return invocation;
}

/// @throws RefusedInPart where the whole may not be refused, or else that has to be said of it
void GraphRun::runNode(std::size_t i, StepReport& step, StepClock& clock, const GoesOn& goesOn) {
  const Node& node = graph_.nodes[i];
  const Operator& op = *node.op;
  Invocation invocation = invocationOf(i, goesOn);
  const auto finish = [&](const Value* value, bool isRefused = false) {
    const std::lock_guard lock(mutex_);
    if (isRefused) tellEnd_ = std::min(tellEnd_, i + 1);
    if (value && settings_.made) settings_.made(i, *value);
    if (value) values_.put(i, *value);
    step.notes = invocation.notes;
    tell(i, invocation.output);
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
      if (!regions_[i].isWhole()) value = partOf(value, regions_[i]);
      if (node.makes()) describeResult(value, false, step);
      clock.stop();
      if (node.makes() && settings_.measureErrors)
        estimateError(value, invocation, invocation.notes);
      keep(i, invocation, value);
      if (node.makes()) step.thumbnail = thumbnailFor(i, value);
      finish(node.makes() ? &value : nullptr);
    }
  } catch (...) {
    clock.stop();
    if (isPartial(i) && isOfInput(std::current_exception())) throw RefusedInPart();
    finish(nullptr, true);
    throw;
  }
}

/// For the next run. What did not reach what was asked is not kept, so that it is told again.
void GraphRun::keep(std::size_t i, const Invocation& invocation, const Value& value) {
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
