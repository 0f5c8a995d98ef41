#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <optional>
#include <vector>

namespace pipeline {

/// A job among others that are told in an order in which they could run one after another.
struct Job {
  std::vector<std::size_t> waitsFor;  ///< jobs before it
  bool waitsForAll = false;           ///< for all before it: it leaves something outside
};

struct JobSettings {
  /// How many run at once at most, and how many that wait for all are worked towards at a time.
  std::size_t threads = 1;
  /// Runs a job, which should end soon by any exception once `goesOn` says false: one before it has
  /// failed. Called from several threads. @return was it done? What waits for it is left otherwise
  std::function<bool(std::size_t job, const std::function<bool()>& goesOn)> run = {};
  /// May it begin beside those that run? Called by one thread at a time.
  std::function<bool(std::size_t job, const std::vector<std::size_t>& running)> mayJoin = {};
};

struct JobsDone {
  std::vector<char> isDone;  ///< by job
  /// The first in order of those that failed, and what it threw. All before it were tried.
  std::optional<std::size_t> failed = {};
  std::exception_ptr failure = {};
};

/// Runs jobs, on the caller's thread and on more where several can begin, the first ones first.
JobsDone scheduleTasks(const std::vector<Job>& jobs, const JobSettings& settings);

}  // namespace pipeline
