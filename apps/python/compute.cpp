#include "apps/python/compute.h"

#include <oneapi/tbb/global_control.h>
#include <signal.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "apps/cli/watch.h"
#include "apps/pipeline/report/report.h"
#include "apps/pipeline/run/runner.h"
#include "levelset/error.h"
#include "levelset/file_target.h"

namespace py = pybind11;

namespace python {
namespace {

std::size_t maxMemory = 0;  // memory limit of all runs, bytes; 0: 80 % of the free memory

/// Removes temporary files that killed processes left in the folder of an output file.
void removeLeftovers(const std::filesystem::path& target) {
  std::error_code ignored;
  const std::filesystem::path file = levelset::canonicalFile(target);
  const std::string begin = "." + file.filename().string() + ".", end = ".tmp";
  if (file.empty()) return;
  for (const auto& item : std::filesystem::directory_iterator(file.parent_path(), ignored)) {
    const std::string name = item.path().filename().string();
    if (!name.starts_with(begin) || !name.ends_with(end)) continue;
    const int process = std::atoi(name.c_str() + begin.size());
    if (process > 0 && ::kill(process, 0) != 0 && errno == ESRCH)
      std::filesystem::remove(item.path(), ignored);
  }
}

using OnValue = std::function<void(std::size_t, const pipeline::Value&)>;

/// A run of a graph in a separate thread, which does not use Python.
class Run {
 public:
  Run(const pipeline::Graph& graph, const RunOptions& options, OnValue onValue)
      : graph_(graph),
        options_(options),
        onValue_(std::move(onValue)),
        thread_([this] { work(); }) {}
  ~Run() {
    end();
    if (thread_.joinable()) thread_.join();
  }

  void end() { goesOn_ = false; }
  /// Waits at most `time` for the end of the run. Returns true when the run has ended, also after
  /// an error.
  bool wait(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [this] { return isDone_; });
  }
  [[nodiscard]] std::pair<std::string, double> state() {
    const std::lock_guard lock(mutex_);
    return {action_, fraction_};
  }

  // Valid after wait() has returned true.
  [[nodiscard]] Outcome& outcome() { return outcome_; }
  [[nodiscard]] bool isWhole() const { return isWhole_; }

 private:
  void work() {
    pipeline::RunReport report;
    try {
      if (options_.isAgain)
        for (const pipeline::Node& node : graph_.nodes)
          if (node.op->targets)
            for (const std::string& target :
                 node.op->targets(pipeline::Invocation(*node.op, node.options)))
              removeLeftovers(target);
      pipeline::run(graph_, settings(), report);
    } catch (...) {
      outcome_.failure = std::current_exception();
    }
    outcome_.report = pipeline::reportJson(report);
    writeReport(report);
    const std::lock_guard lock(mutex_);
    isDone_ = true;
    isWhole_ = !outcome_.failure;
    if (isWhole_) fraction_ = 1;
    changed_.notify_all();
  }

  /// Writes the report file. A failure to write it does not replace an earlier error.
  void writeReport(const pipeline::RunReport& report) {
    if (options_.report.empty()) return;
    try {
      pipeline::writeReport(options_.report, report);
    } catch (...) {
      if (!outcome_.failure) outcome_.failure = std::current_exception();
    }
  }

  pipeline::RunSettings settings() {
    pipeline::RunSettings settings;
    settings.maxMemory = options_.maxMemory > 0 ? options_.maxMemory : memoryLimit();
    settings.cache = options_.cache;
    settings.measureErrors = settings.measurePeaks = options_.measureErrors;
    if (pipeline::isPage(options_.report)) settings.thumbnails = pipeline::kMostThumbnails;
    settings.begin = [this](const std::string& action) {
      if (!goesOn_) throw levelset::Cancelled(action + ": cancelled");
      reportProgress(action, 0);
    };
    settings.progress = [this](std::size_t, const std::string& action, double fraction) {
      reportProgress(action, fraction);
    };
    settings.shouldContinue = [this] { return goesOn_.load(); };
    settings.onValue = onValue_;
    settings.print = [this](const std::string& text) { outcome_.printed += text; };
    settings.warn = [this](const std::string& text) { outcome_.warnings.push_back(text); };
    settings.note = [this](const std::string& text) { outcome_.notes.push_back(text); };
    return settings;
  }

  void reportProgress(const std::string& action, double fraction) {
    const std::lock_guard lock(mutex_);
    action_ = action;
    fraction_ = fraction;
  }

  const pipeline::Graph& graph_;
  const RunOptions& options_;
  const OnValue onValue_;
  Outcome outcome_;
  std::atomic<bool> goesOn_ = true;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool isDone_ = false, isWhole_ = false;
  std::string action_;
  double fraction_ = 0;
  // Declared last, because the thread starts at once and uses the other members.
  std::thread thread_;
};

/// Runs the Python signal handlers, and calls the progress function if there is one.
/// @throws py::error_already_set if one of these functions raises an exception
void attend(Run& run, const py::object& progress) {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  if (progress.is_none()) return;
  const auto [action, fraction] = run.state();
  if (action.empty()) return;
  const py::object answer = progress(action, fraction);
  if (answer.ptr() == Py_False) run.end();
}

/// Waits for a run, and handles signals and progress meanwhile.
/// @return outcome of the run; an exception raised by a signal handler or `progress` is its failure
Outcome wait(Run& run, const py::object& progress) {
  constexpr std::chrono::milliseconds kInterval(50);
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
  Outcome outcome = std::move(run.outcome());
  if (raised) outcome.failure = raised;
  return outcome;
}

}  // namespace

Outcome compute(const std::vector<LazyPtr>& values, const RunOptions& options) {
  Request request(values);
  Outcome outcome;
  bool isDone = false;
  {
    Run run(request.graph(), options,
            [&](std::size_t node, const pipeline::Value& value) { request.keep(node, value); });
    outcome = wait(run, options.progress);
    isDone = run.isWhole();
  }
  request.settle(isDone);
  return outcome;
}

Outcome compute(const pipeline::Graph& graph, const RunOptions& options) {
  Run run(graph, options, {});
  return wait(run, options.progress);
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
