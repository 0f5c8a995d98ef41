#include "apps/python/compute.h"

#include <oneapi/tbb/global_control.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "apps/cli/watch.h"
#include "apps/pipeline/report.h"
#include "apps/pipeline/runner.h"
#include "levelset/error.h"

namespace py = pybind11;

namespace python {
namespace {

std::size_t maxMemory = 0;  // of all runs; 0: what is free tells

/// A run in a thread of its own. Nothing here touches Python.
class Run {
 public:
  explicit Run(Request& request) : request_(request), thread_([this] { work(); }) {}
  ~Run() {
    end();
    if (thread_.joinable()) thread_.join();
  }

  void end() { goesOn_ = false; }
  /// @return is it done?
  bool wait(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [this] { return isDone_; });
  }
  [[nodiscard]] std::pair<std::string, double> state() {
    const std::lock_guard lock(mutex_);
    return {action_, fraction_};
  }

  // Once it is done.
  [[nodiscard]] Outcome& outcome() { return outcome_; }

 private:
  void work() {
    pipeline::RunReport report;
    try {
      pipeline::run(request_.graph(), settings(), report);
    } catch (...) {
      outcome_.failure = std::current_exception();
    }
    outcome_.report = pipeline::reportJson(report);
    const std::lock_guard lock(mutex_);
    isDone_ = true;
    if (!outcome_.failure) fraction_ = 1;
    changed_.notify_all();
  }

  pipeline::RunSettings settings() {
    pipeline::RunSettings settings;
    settings.maxMemory = memoryLimit();
    settings.begin = [this](const std::string& action) {
      if (!goesOn_) throw levelset::Cancelled(action + ": cancelled");
      tell(action, 0);
    };
    settings.progress = [this](std::size_t, const std::string& action, double fraction) {
      tell(action, fraction);
    };
    settings.goesOn = [this] { return goesOn_.load(); };
    settings.made = [this](std::size_t node, const pipeline::Value& value) {
      request_.keep(node, value);
    };
    settings.print = [this](const std::string& text) { outcome_.printed += text; };
    settings.warn = [this](const std::string& text) { outcome_.warnings.push_back(text); };
    settings.note = [this](const std::string& text) { outcome_.notes.push_back(text); };
    return settings;
  }

  void tell(const std::string& action, double fraction) {
    const std::lock_guard lock(mutex_);
    action_ = action;
    fraction_ = fraction;
  }

  Request& request_;
  Outcome outcome_;
  std::atomic<bool> goesOn_ = true;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool isDone_ = false;
  std::string action_;
  double fraction_ = 0;
  std::thread thread_;  // last: it begins at once
};

/// Looks after signals and progress. @throws what their code raises
void attend(Run& run, const py::object& progress) {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  if (progress.is_none()) return;
  const auto [action, fraction] = run.state();
  if (action.empty()) return;
  const py::object answer = progress(action, fraction);
  if (answer.ptr() == Py_False) run.end();
}

}  // namespace

Outcome compute(const std::vector<LazyPtr>& values, const py::object& progress) {
  constexpr std::chrono::milliseconds kInterval(50);
  Request request(values);
  Run run(request);
  std::exception_ptr raised;
  for (bool isDone = false; !isDone;) {
    {
      const py::gil_scoped_release release;
      isDone = run.wait(kInterval);
    }
    if (raised) continue;
    try {
      attend(run, progress);
    } catch (const py::error_already_set&) {
      raised = std::current_exception();
      run.end();
    }
  }
  Outcome& outcome = run.outcome();
  request.settle(!outcome.failure);
  if (raised) outcome.failure = raised;
  return std::move(outcome);
}

void setThreads(std::size_t count) {
  static std::unique_ptr<tbb::global_control> limit;
  limit.reset();
  if (count > 0)
    limit =
        std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, count);
}

void setMaxMemory(std::size_t bytes) {
  maxMemory = bytes;
}

std::size_t memoryLimit() {
  return maxMemory > 0 ? maxMemory : cli::defaultMemoryLimit();
}

}  // namespace python
