#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/cache/cache.h"
#include "apps/pipeline/graph/graph.h"
#include "apps/pipeline/graph/regions_of_interest.h"
#include "apps/pipeline/run/runner.h"
#include "apps/pipeline/run/step_measures.h"
#include "apps/pipeline/run/task_scheduler.h"

namespace pipeline {

/// Values of nodes that have run. Keeps each value until its last consumer takes it.
class Values {
 public:
  /// @param uses  number of consumers of each node
  explicit Values(std::vector<std::size_t> uses) : uses_(std::move(uses)), values_(uses_.size()) {}

  [[nodiscard]] bool has(std::size_t node) const { return values_[node].has_value(); }
  [[nodiscard]] const Value& peek(std::size_t node) const { return *values_[node]; }
  void addUse(std::size_t node) { ++uses_[node]; }
  void put(std::size_t node, Value value) {
    if (uses_[node] > 0) values_[node] = std::move(value);
  }
  /// Removes a value. It must be put again before the next take().
  void drop(std::size_t node) { values_[node].reset(); }
  /// Returns a value. The last call gives up the stored copy. Its consumer may then modify the
  /// value in place, unless another consumer still shares the data.
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

/// One run of a graph. Independent branches run concurrently. Some nodes run one after another at
/// the end: a node with a damaged cache entry, or a node that failed on a region of interest. The
/// latter may succeed on complete values.
class GraphRun {
 public:
  GraphRun(const Graph& graph, const RunSettings& settings, RunReport& report);

  /// Runs the graph. The report contains all steps that ran, even if this function throws.
  void run();

  /// Runs a graph on the box RunSettings::part.
  /// @return the value of a node. It equals the complete value in the box.
  /// @throws levelset::NoSurface if a value has no surface there
  [[nodiscard]] Value runPart(std::size_t result);

 private:
  enum class NodeState {
    Unneeded,  // no requested result depends on it
    Compute,   // its operator must run
    Load,      // its value is read from the cache, for a node that runs or for the caller
    UpToDate   // not to run: it has run, its files are unchanged, or no node that runs needs it
  };
  /// Failure of a node on a region of interest. The node may succeed on complete values.
  struct RegionFailure {};
  using ContinueCheck = std::function<bool()>;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  // Order of execution and of the report, defined in graph_run.cpp.
  std::vector<std::size_t> decideStates();
  void runNodes();
  void runInOrder(const std::vector<char>& isDone, std::size_t end);
  StepReport& begin(std::size_t i);
  void addSteps(const RunReport& part);
  void collectSteps();
  Thumbnail thumbnailFor(std::size_t i, const Value& value);
  void queueOutput(std::size_t i, const std::string& output);
  void reportInOrder();
  [[nodiscard]] bool isGiven(std::size_t i) const { return graph_.given.contains(i); }
  [[nodiscard]] bool isLimited() const { return settings_.maxMemory != levelset::kNoMemoryLimit; }

  // Cached results of earlier runs, defined in graph_run_cache.cpp.
  void useCache(const std::vector<char>& needed);
  [[nodiscard]] bool isUpToDate(const std::string& key) const;
  void loadFromCache(std::size_t i);
  bool tryLoad(std::size_t i);
  void storeInCache(std::size_t i, const Invocation& invocation, const Value& value);

  // Sizes and regions of interest, computed before the run; defined in graph_run_plan.cpp.
  void planNodes();
  std::optional<Plan> planFromMesh(std::size_t i);
  [[nodiscard]] bool isRestricted(std::size_t i) const;
  void requestFullValues(std::size_t i);
  [[nodiscard]] bool fitsInMemory(std::size_t i, const std::vector<std::size_t>& running) const;
  [[nodiscard]] std::optional<double> workingBytes(std::size_t i) const;

  // Results that do not fit into memory, defined in graph_run_parts.cpp.
  void runInParts(std::size_t write);
  [[nodiscard]] bool isPart() const { return !levelset::isEverywhere(settings_.part); }

  // Concurrent branches, defined in graph_run_tasks.cpp.
  [[nodiscard]] bool hasBranches() const;
  [[nodiscard]] std::vector<Task> tasks() const;
  ScheduleResult scheduleTasks();
  bool runTask(std::size_t i, const ContinueCheck& shouldContinue);

  // Execution of one node, defined in graph_run_node.cpp.
  void compute(std::size_t i);
  void runChecked(std::size_t i, const ContinueCheck& shouldContinue, const ArenaCpu* arena);
  void runNode(std::size_t i, StepReport& step, StepClock& clock,
               const ContinueCheck& shouldContinue);
  [[nodiscard]] Invocation invocationOf(std::size_t i, const ContinueCheck& shouldContinue);

  const Graph& graph_;
  const RunSettings& settings_;
  RunReport& report_;
  const std::size_t threads_;
  std::vector<NodeState> states_;
  std::optional<Cache> cache_;
  std::vector<std::optional<std::string>> keys_;
  std::vector<RegionOfInterest> regions_;
  // Plan of the complete value of each node; empty: unknown.
  std::vector<std::optional<Plan>> plans_;
  // Per node: it ran already, because its plan requires its mesh.
  std::vector<char> isComputedForPlan_;
  // Per node: error while it ran for its plan; null: none.
  std::vector<std::exception_ptr> planningFailures_;
  // Action that writes the result in parts, because the result does not fit into memory.
  std::optional<std::size_t> partedWrite_;
  double planningBytes_ = 0;  // memory of the meshes computed for planning, bytes
  // Per node: it failed on a region of interest, and must run again on complete values.
  std::vector<char> needsFullValues_;
  RunningSteps running_;
  std::vector<std::optional<StepReport>> steps_;  // one per node; empty: did not run
  // Printed text of finished nodes; empty: not finished.
  std::vector<std::optional<std::string>> pendingOutput_;
  // Index of the first node whose messages are not yet reported, and of the node before which
  // reporting stops.
  std::size_t nextReported_ = 0, reportEnd_ = kNone;
  std::mutex mutex_;  // guards values, states, steps, output and the callbacks of the settings
  Values values_;     // last member: its initializer, decideStates(), also sets members above
};

}  // namespace pipeline
