#include "apps/pipeline/run/task_scheduler.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

namespace pipeline {
namespace {

class TaskScheduler {
 public:
  TaskScheduler(const std::vector<Task>& tasks, const SchedulerSettings& settings)
      : tasks_(tasks),
        settings_(settings),
        states_(tasks.size(), State::Waiting),
        barriersBefore_(tasks.size()) {
    for (std::size_t i = 0, barriers = 0; i < tasks.size(); ++i) {
      barriersBefore_[i] = barriers;
      if (tasks[i].isBarrier) ++barriers;
    }
  }

  ScheduleResult run() {
    runWorker();
    for (std::thread& thread : workers_) thread.join();
    ScheduleResult all;
    for (const State state : states_) all.isDone.push_back(state == State::Done);
    if (failure_) all.failed = firstFailure_.load();
    all.failure = failure_;
    return all;
  }

 private:
  enum class State { Waiting, Running, Done, Skipped };

  void runWorker() {
    std::unique_lock lock(mutex_);
    for (;;) {
      const std::optional<std::size_t> task = nextTask();
      if (!task) {
        if (running_.empty()) return changed_.notify_all();
        ++idleWorkers_;
        changed_.wait(lock);
        --idleWorkers_;
        continue;
      }
      states_[*task] = State::Running;
      running_.push_back(*task);
      addWorker();
      lock.unlock();
      State end = State::Skipped;
      std::exception_ptr failure;
      try {
        if (settings_.run(*task, [this, task] { return *task <= firstFailure_; }))
          end = State::Done;
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      running_.erase(std::find(running_.begin(), running_.end(), *task));
      if (end == State::Skipped)
        skip(*task);
      else
        states_[*task] = end;
      if (failure && *task < firstFailure_) {
        firstFailure_ = *task;
        failure_ = failure;
      }
      changed_.notify_all();
    }
  }

  /// Starts one more thread if another task can start now.
  void addWorker() {
    if (idleWorkers_ > 0 || workers_.size() + 1 >= settings_.threads || !nextTask()) return;
    try {
      workers_.emplace_back([this] { runWorker(); });
    } catch (const std::system_error&) {
      // The system gives no more threads: the existing ones run all tasks.
    }
  }

  /// Finds the first task that can start.
  std::optional<std::size_t> nextTask() {
    if (running_.size() >= settings_.threads) return {};
    for (std::size_t i = firstUnfinished_; i < std::min(tasks_.size(), firstFailure_.load()); ++i) {
      const bool canStart = states_[i] == State::Waiting && isReady(i);
      if (i == firstUnfinished_ && isFinished(i)) {  // isReady() may have set task i to Skipped
        ++firstUnfinished_;
        continue;
      }
      // The results of tasks that are many barriers ahead would occupy memory for a long time.
      if (barriersBefore_[i] >= barriersBefore_[firstUnfinished_] + settings_.threads) break;
      if (!canStart) continue;
      // Later tasks wait as well: small tasks could otherwise delay a large one forever.
      if (!running_.empty() && !settings_.mayStart(i, running_)) break;
      return i;
    }
    return {};
  }

  [[nodiscard]] bool isFinished(std::size_t i) const {
    return states_[i] == State::Done || states_[i] == State::Skipped;
  }

  /// Decides if a waiting task can start. Skips a task that can never start.
  bool isReady(std::size_t i) {
    const auto blocks = [&](std::size_t before) { return states_[before] != State::Done; };
    const auto isSkipped = [&](std::size_t before) { return states_[before] == State::Skipped; };
    const Task& task = tasks_[i];
    if (task.isBarrier ? firstSkipped_ < i
                       : std::any_of(task.dependencies.begin(), task.dependencies.end(), isSkipped))
      skip(i);
    if (states_[i] != State::Waiting) return false;
    return task.isBarrier
               ? i == firstUnfinished_
               : std::none_of(task.dependencies.begin(), task.dependencies.end(), blocks);
  }

  void skip(std::size_t i) {
    states_[i] = State::Skipped;
    firstSkipped_ = std::min(firstSkipped_, i);
  }

  const std::vector<Task>& tasks_;
  const SchedulerSettings& settings_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<State> states_;
  std::vector<std::size_t> barriersBefore_;  // number of barriers before each task
  std::vector<std::size_t> running_;
  std::vector<std::thread> workers_;
  std::size_t idleWorkers_ = 0;
  std::size_t firstUnfinished_ = 0;  // first task that is neither done nor skipped
  std::size_t firstSkipped_ = static_cast<std::size_t>(-1);
  std::atomic<std::size_t> firstFailure_ = static_cast<std::size_t>(-1);
  std::exception_ptr failure_;
};

}  // namespace

ScheduleResult scheduleTasks(const std::vector<Task>& tasks, const SchedulerSettings& settings) {
  return TaskScheduler(tasks, settings).run();
}

}  // namespace pipeline
