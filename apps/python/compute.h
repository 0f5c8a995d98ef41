#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <filesystem>

#include "apps/python/lazy.h"

namespace python {

/// Results of a run, except the values.
struct Outcome {
  std::string report;   ///< report of the run, JSON
  std::string printed;  ///< text that the actions printed for the user
  std::vector<std::string> warnings, notes;
  /// A levelset::Error, or an exception raised by `progress` or a signal handler; null: none.
  std::exception_ptr failure;
};
/// Options of a run.
struct RunOptions {
  /// None, or a function of the name of an action and the completed fraction. It is called in the
  /// thread that calls compute(), at most 20 times per second and once at the end. Returning False
  /// ends the run.
  pybind11::object progress = pybind11::none();
  std::filesystem::path cache = {};  ///< cache folder; empty: no cache
  /// The job may have been started before by a process that was killed. Temporary files that it
  /// left beside the output files are removed.
  bool isAgain = false;
  // Used only by jobs that run a pipeline.
  std::filesystem::path report = {};  ///< report file; empty: none
  bool measureErrors = false;         ///< estimate the error of each result
  std::size_t maxMemory = 0;          ///< memory limit, bytes; 0: the limit of setMaxMemory()
};

/// Computes lazy values in a separate thread, and stores the results in them. The calling thread
/// waits without the interpreter's lock, and handles signals.
[[nodiscard]] Outcome compute(const std::vector<LazyPtr>& values, const RunOptions& options);
/// Runs a complete graph for its output files and printed text.
[[nodiscard]] Outcome compute(const pipeline::Graph& graph, const RunOptions& options);

/// Sets the number of threads of all later runs; 0: the number of cores.
void setThreads(std::size_t count);
/// Sets the memory limit of all later runs, bytes; 0: 80 % of the free memory.
void setMaxMemory(std::size_t bytes);
/// Memory limit of a run, bytes.
[[nodiscard]] std::size_t memoryLimit();

}  // namespace python
