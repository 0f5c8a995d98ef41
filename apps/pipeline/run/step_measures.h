#pragma once

#include <tbb/task_scheduler_observer.h>

#include <chrono>
#include <map>
#include <mutex>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/run/runner.h"

/// Measurements of a step for the report: error, size, time and memory.
namespace pipeline {

/// Estimates the error of a result from the result and its operands. Adds the figures to `notes`.
void estimateError(const Value& value, const Invocation& invocation, StepNotes& notes);

/// Records the kind and size of a result in its step.
/// @param dryRun  true: `value` contains only a plan, so sizes are estimates
void describeResult(const Value& value, bool dryRun, StepReport& step);

/// Measures the CPU time that threads spend inside a TBB arena.
class ArenaCpu : public tbb::task_scheduler_observer {
 public:
  explicit ArenaCpu(tbb::task_arena& arena);
  ~ArenaCpu() override;
  ArenaCpu(const ArenaCpu&) = delete;
  ArenaCpu& operator=(const ArenaCpu&) = delete;

  void on_scheduler_entry(bool isWorker) override;
  void on_scheduler_exit(bool isWorker) override;
  [[nodiscard]] double seconds() const;

 private:
  mutable std::mutex mutex_;
  std::map<pthread_t, double>
      since_;        // for each thread inside the arena, its CPU seconds when it entered
  double past_ = 0;  // CPU seconds that threads spent in the arena before they left it
};

class StepClock;

/// The clocks of the steps that run at the same time.
class RunningSteps {
 public:
  /// @param resetsPeaks  each step's peak is its own; false: the peak of the process so far
  explicit RunningSteps(bool resetsPeaks) : resetsPeaks_(resetsPeaks) {}
  void add(StepClock& clock);
  void remove(StepClock& clock);
  /// Resets the peak resident memory of the process, if steps reset it and none runs. Memory that
  /// was used before then counts for no step.
  void resetPeak();

 private:
  void updatePeaks();

  std::mutex mutex_;
  std::vector<StepClock*> clocks_;
  bool resetsPeaks_;
};

/// Measures time and memory of a step until stop(). A step that runs alone gets the CPU time of the
/// complete process. A concurrent step gets the CPU time of its arena, and the memory peak of the
/// complete process.
class StepClock {
 public:
  /// @param arena  arena of the step; null: no other step runs concurrently
  StepClock(StepReport& step, RunningSteps& running, const ArenaCpu* arena = nullptr);
  ~StepClock() { stop(); }
  StepClock(const StepClock&) = delete;
  StepClock& operator=(const StepClock&) = delete;

  /// Adds time and memory to the figures of the step. Further calls have no effect.
  void stop();

 private:
  friend class RunningSteps;
  StepReport& step_;
  RunningSteps& running_;
  const ArenaCpu* arena_;
  std::chrono::steady_clock::time_point start_;
  double cpu_;
  bool isAlone_ = true, isStopped_ = false;
};

}  // namespace pipeline
