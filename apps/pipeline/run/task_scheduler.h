#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <optional>
#include <vector>

namespace pipeline {

/// A task of an ordered list. Running the tasks one after another in list order is always valid.
struct Task {
  std::vector<std::size_t> dependencies;  ///< indices of earlier tasks that must be done first
  /// Waits for all earlier tasks, because it has effects beside its value, such as written files.
  bool isBarrier = false;
};

struct SchedulerSettings {
  /// Largest number of tasks that run at once. Also limits how many barriers ahead of the first
  /// unfinished task a task may start.
  std::size_t threads = 1;
  /// Runs a task. Several threads call this function.
  /// `shouldContinue` returns false once an earlier task has failed. The task should then end soon
  /// by throwing any exception.
  /// @return true when the task is done; false skips the task and all tasks that depend on it
  std::function<bool(std::size_t task, const std::function<bool()>& shouldContinue)> run = {};
  /// Decides if a task may start while the `running` tasks run. Calls never overlap.
  std::function<bool(std::size_t task, const std::vector<std::size_t>& running)> mayStart = {};
};

struct ScheduleResult {
  std::vector<char> isDone;  ///< one flag per task
  /// Index of the failed task that is first in the list. All tasks before it were tried.
  std::optional<std::size_t> failed = {};
  std::exception_ptr failure = {};  ///< exception that the failed task threw; null: none failed
};

/// Runs tasks on the caller's thread, and on further threads when several tasks can start.
/// Prefers tasks that are earlier in the list.
ScheduleResult scheduleTasks(const std::vector<Task>& tasks, const SchedulerSettings& settings);

}  // namespace pipeline
