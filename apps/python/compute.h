#pragma once

#include <pybind11/pybind11.h>

#include <exception>

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

/// Computes values and keeps them, in a thread of its own, while this one waits for signals without
/// holding the interpreter's lock.
/// @param progress  None, or called in this thread with the name of an action and the fraction done
///                  of it: at most 20 times a second, and once in the end; False ends the run
[[nodiscard]] Outcome compute(const std::vector<LazyPtr>& values, const pybind11::object& progress);

/// Of all runs from now on: threads, or 0 for as many as there are cores; bytes, or 0 for 80 % of
/// what is free.
void setThreads(std::size_t count);
void setMaxMemory(std::size_t bytes);
[[nodiscard]] std::size_t memoryLimit();

}  // namespace python
