#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <filesystem>

#include "apps/python/lazy.h"

namespace python {

/// Results of a run apart from the values.
struct Outcome {
  std::string report;  ///< JSON
  std::string printed;
  std::vector<std::string> warnings, notes;
  std::exception_ptr
      failure;  ///< a levelset::Error, or an exception raised by `progress` or a signal handler
};
/// Options of a run.

struct RunOptions {
  /// None, or a function of the name of an action and the completed fraction. It is called in this
  /// thread, at most 20 times per second and once at the end. Returning False ends the run.
  pybind11::object progress = pybind11::none();
  std::filesystem::path cache = {};  ///< cache folder; empty: no cache
  /// The job may have been started before by a process that was killed. Temporary files that it
  /// left beside the output files are removed.
  bool isAgain = false;
  // For pipelines only.
  std::filesystem::path report = {};  ///< report file; empty: none
  bool measureErrors = false;
  std::size_t maxMemory = 0;  ///< bytes; 0: the limit of setMaxMemory()
};

/// Computes values and keeps them, in a thread of its own. The calling thread waits for signals
/// without holding the interpreter's lock.
[[nodiscard]] Outcome compute(const std::vector<LazyPtr>& values, const RunOptions& options);
/// Runs a graph as written, for its output files and printed text.
[[nodiscard]] Outcome compute(const pipeline::Graph& graph, const RunOptions& options);

/// Settings of all later runs: number of threads, 0 for the number of cores; bytes, 0 for 80 % of
/// the free memory.
void setThreads(std::size_t count);
void setMaxMemory(std::size_t bytes);
[[nodiscard]] std::size_t memoryLimit();

}  // namespace python
