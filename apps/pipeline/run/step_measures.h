#pragma once

#include <tbb/task_scheduler_observer.h>

#include <chrono>
#include <map>
#include <mutex>
#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/run/runner.h"

/// What is told of a step beside what it makes.
namespace pipeline {

/// How far off a result may be, by what can be told from the result itself.
void estimateError(const Value& value, const Invocation& invocation, StepNotes& notes);

/// Sizes and kind of what a step made. @param dryRun  it is a plan
void describeResult(const Value& value, bool dryRun, StepReport& step);

/// CPU time of the threads that work in an arena, as long as they do.
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
  std::map<pthread_t, double> since_;  // CPU seconds of those that are in it, when they came
  double past_ = 0;
};

class StepClock;

/// The steps that run at a time.
class RunningSteps {
 public:
  void add(StepClock& clock);
  void remove(StepClock& clock);
  /// What was taken until now is of none of those that run.
  void forgetPeak();

 private:
  void tellPeak();

  std::mutex mutex_;
  std::vector<StepClock*> clocks_;
};

/// Measures a step until it is told to stop; what follows is the report's own work. A step that has
/// the process to itself takes all that this takes; of one beside others it is what the threads of
/// its arena take, and the peak is of all of them.
class StepClock {
 public:
  /// @param arena  that the step runs in, if it may have others beside it
  StepClock(StepReport& step, RunningSteps& running, const ArenaCpu* arena = nullptr);
  ~StepClock() { stop(); }
  StepClock(const StepClock&) = delete;
  StepClock& operator=(const StepClock&) = delete;

  /// Adds to what the step took before.
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
