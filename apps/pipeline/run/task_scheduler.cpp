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

class SideBySide {
 public:
  SideBySide(const std::vector<Job>& jobs, const JobSettings& settings)
      : jobs_(jobs), settings_(settings), states_(jobs.size(), State::Waits), group_(jobs.size()) {
    for (std::size_t i = 0, group = 0; i < jobs.size(); ++i) {
      group_[i] = group;
      if (jobs[i].waitsForAll) ++group;
    }
  }

  JobsDone run() {
    work();
    for (std::thread& thread : threads_) thread.join();
    JobsDone all;
    for (const State state : states_) all.isDone.push_back(state == State::Done);
    if (failure_) all.failed = firstFailure_.load();
    all.failure = failure_;
    return all;
  }

 private:
  enum class State { Waits, Runs, Done, Undone };

  void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      const std::optional<std::size_t> job = next();
      if (!job) {
        if (running_.empty()) return changed_.notify_all();
        ++idle_;
        changed_.wait(lock);
        --idle_;
        continue;
      }
      states_[*job] = State::Runs;
      running_.push_back(*job);
      enlist();
      lock.unlock();
      State end = State::Undone;
      std::exception_ptr failure;
      try {
        if (settings_.run(*job, [this, job] { return *job <= firstFailure_; })) end = State::Done;
      } catch (...) {
        failure = std::current_exception();
      }
      lock.lock();
      running_.erase(std::find(running_.begin(), running_.end(), *job));
      if (end == State::Undone)
        leave(*job);
      else
        states_[*job] = end;
      if (failure && *job < firstFailure_) {
        firstFailure_ = *job;
        failure_ = failure;
      }
      changed_.notify_all();
    }
  }

  /// One more thread where there is something for it to do.
  void enlist() {
    if (idle_ > 0 || threads_.size() + 1 >= settings_.threads || !next()) return;
    try {
      threads_.emplace_back([this] { work(); });
    } catch (const std::system_error&) {
      // Then those that there are do it.
    }
  }

  /// The first that can begin.
  std::optional<std::size_t> next() {
    if (running_.size() >= settings_.threads) return {};
    for (std::size_t i = firstOpen_; i < std::min(jobs_.size(), firstFailure_.load()); ++i) {
      const bool canBegin = states_[i] == State::Waits && isReady(i);
      if (i == firstOpen_ && hasEnded(i)) {  // isReady() may have left it just now
        ++firstOpen_;
        continue;
      }
      // Those far ahead would hold their results for long.
      if (group_[i] >= group_[firstOpen_] + settings_.threads) break;
      if (!canBegin) continue;
      // Nor do later ones join: small ones would overtake a large one for ever.
      if (!running_.empty() && !settings_.mayJoin(i, running_)) break;
      return i;
    }
    return {};
  }

  [[nodiscard]] bool hasEnded(std::size_t i) const {
    return states_[i] == State::Done || states_[i] == State::Undone;
  }

  /// Also finds what can never begin.
  bool isReady(std::size_t i) {
    const auto blocks = [&](std::size_t before) { return states_[before] != State::Done; };
    const auto isLeft = [&](std::size_t before) { return states_[before] == State::Undone; };
    const Job& job = jobs_[i];
    if (job.waitsForAll ? firstLeft_ < i
                        : std::any_of(job.waitsFor.begin(), job.waitsFor.end(), isLeft))
      leave(i);
    if (states_[i] != State::Waits) return false;
    return job.waitsForAll ? i == firstOpen_
                           : std::none_of(job.waitsFor.begin(), job.waitsFor.end(), blocks);
  }

  void leave(std::size_t i) {
    states_[i] = State::Undone;
    firstLeft_ = std::min(firstLeft_, i);
  }

  const std::vector<Job>& jobs_;
  const JobSettings& settings_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<State> states_;
  std::vector<std::size_t> group_;  // by job: how many that wait for all come before it
  std::vector<std::size_t> running_;
  std::vector<std::thread> threads_;
  std::size_t idle_ = 0;
  std::size_t firstOpen_ = 0;  // neither done nor left
  std::size_t firstLeft_ = static_cast<std::size_t>(-1);
  std::atomic<std::size_t> firstFailure_ = static_cast<std::size_t>(-1);
  std::exception_ptr failure_;
};

}  // namespace

JobsDone scheduleTasks(const std::vector<Job>& jobs, const JobSettings& settings) {
  return SideBySide(jobs, settings).run();
}

}  // namespace pipeline
