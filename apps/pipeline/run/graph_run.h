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
#include "apps/pipeline/graph/region_of_interest.h"
#include "apps/pipeline/run/runner.h"
#include "apps/pipeline/run/step_measures.h"
#include "apps/pipeline/run/task_scheduler.h"

namespace pipeline {

/// Values of nodes that have run, as long as something is to take them.
class Values {
 public:
  /// @param uses  of each
  explicit Values(std::vector<std::size_t> uses) : uses_(std::move(uses)), values_(uses_.size()) {}

  [[nodiscard]] bool has(std::size_t node) const { return values_[node].has_value(); }
  [[nodiscard]] const Value& peek(std::size_t node) const { return *values_[node]; }
  void addUse(std::size_t node) { ++uses_[node]; }
  void put(std::size_t node, Value value) {
    if (uses_[node] > 0) values_[node] = std::move(value);
  }
  /// Makes `take` find nothing, so that it has to be put again.
  void drop(std::size_t node) { values_[node].reset(); }
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

/// One run of a graph. Branches run side by side as long as nothing is odd; what cannot be done
/// like that (a damaged entry of the cache, a part that is refused where the whole may not be) is
/// left to the end and done one after another.
class GraphRun {
 public:
  GraphRun(const Graph& graph, const RunSettings& settings, RunReport& report);

  /// Also where it throws, the steps that ran are in the report.
  void run();

 private:
  enum class NodeState {
    LeftOut,  // nothing needs it
    Run,
    Load,  // its value is known, and taken by one that runs
    Known  // and not even that is needed
  };
  using GoesOn = std::function<bool()>;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  std::vector<std::size_t> decideStates();
  void useCache(const std::vector<char>& needed);
  [[nodiscard]] bool isUpToDate(const std::string& key) const;

  void planAhead();
  std::optional<Plan> planEarly(std::size_t i);
  [[nodiscard]] bool isPartial(std::size_t i) const;
  void makeWhole(std::size_t i);

  void runNodes();
  void runInOrder(const std::vector<char>& isDone, std::size_t end);
  [[nodiscard]] bool isBranched() const;
  [[nodiscard]] std::vector<Job> jobs() const;
  JobsDone scheduleTasks();
  bool runBeside(std::size_t i, const GoesOn& goesOn);
  [[nodiscard]] bool fitsBeside(std::size_t i, const std::vector<std::size_t>& running) const;
  [[nodiscard]] std::optional<double> workBytes(std::size_t i) const;

  [[nodiscard]] bool isGiven(std::size_t i) const { return graph_.given.contains(i); }
  Thumbnail thumbnailFor(std::size_t i, const Value& value);
  [[nodiscard]] bool isLimited() const { return settings_.maxMemory != levelset::kNoMemoryLimit; }
  StepReport& begin(std::size_t i);
  void fileSteps();
  void tell(std::size_t i, const std::string& output);
  void tellInOrder();
  void recall(std::size_t i);
  bool recallValue(std::size_t i);
  void compute(std::size_t i);
  void attempt(std::size_t i, const GoesOn& goesOn, const ArenaCpu* arena);
  void runNode(std::size_t i, StepReport& step, StepClock& clock, const GoesOn& goesOn);
  [[nodiscard]] Invocation invocationOf(std::size_t i, const GoesOn& goesOn);
  void keep(std::size_t i, const Invocation& invocation, const Value& value);

  const Graph& graph_;
  const RunSettings& settings_;
  RunReport& report_;
  const std::size_t threads_;
  std::vector<NodeState> states_;
  std::optional<Cache> cache_;
  std::vector<std::optional<std::string>> keys_;
  std::vector<RegionOfInterest> regions_;
  std::vector<std::optional<Plan>> plans_;  // of whole values, as far as they were told ahead
  std::vector<char> wasEarly_;              // ran to be planned with
  std::vector<std::exception_ptr> earlyFailures_;
  double earlyBytes_ = 0;
  std::vector<char> isRefused_;  // of a part, and is to be tried of the whole
  RunningSteps running_;
  std::vector<std::optional<StepReport>> steps_;      // by node
  std::vector<std::optional<std::string>> unspoken_;  // what ended, and is told in its turn
  std::size_t nextTold_ = 0, tellEnd_ = kNone;
  std::mutex mutex_;  // of the values, the fates, what is told, and the settings' functions
  Values values_;     // the last: decideStates() fills the others
};

}  // namespace pipeline
