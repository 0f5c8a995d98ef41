#pragma once

#include <pybind11/pybind11.h>

#include <exception>
#include <filesystem>

#include "apps/python/lazy.h"

namespace python {

/// What a run left behind beside the values.
struct Outcome {
  std::string report;  ///< JSON
  std::string printed;
  std::vector<std::string> warnings, notes;
  std::exception_ptr
      failure;  ///< a levelset::Error, or what `progress` or a signal's handler raised
};

struct RunOptions {
  /// None, or called in this thread with the name of an action and the fraction done of it: at most
  /// 20 times a second, and once in the end; False ends the run.
  pybind11::object progress = pybind11::none();
  std::filesystem::path cache = {};  ///< folder of earlier results; empty: none are kept
  /// It may have been begun before, by a process that was killed: what that left beside the files
  /// that are to be written is removed.
  bool isAgain = false;
  // Of a pipeline.
  std::filesystem::path report = {};  ///< where to write it; empty: nowhere
  bool measureErrors = false;
  std::size_t maxMemory = 0;  ///< bytes; 0: as setMaxMemory
};

/// Computes values and keeps them, in a thread of its own, while this one waits for signals without
/// holding the interpreter's lock.
[[nodiscard]] Outcome compute(const std::vector<LazyPtr>& values, const RunOptions& options);
/// The same of a graph as it was written, for what it writes and prints.
[[nodiscard]] Outcome compute(const pipeline::Graph& graph, const RunOptions& options);

/// Of all runs from now on: threads, or 0 for as many as there are cores; bytes, or 0 for 80 % of
/// what is free.
void setThreads(std::size_t count);
void setMaxMemory(std::size_t bytes);
[[nodiscard]] std::size_t memoryLimit();

}  // namespace python
