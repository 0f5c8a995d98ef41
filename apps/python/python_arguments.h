#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "apps/python/lazy.h"

namespace python {

/// A lazy value, held by a Python object.
class Handle {
 public:
  explicit Handle(LazyPtr lazy) : lazy_(std::move(lazy)) { lazy_->hold(); }
  ~Handle() { lazy_->release(); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;

  [[nodiscard]] const LazyPtr& lazy() const { return lazy_; }

 private:
  LazyPtr lazy_;
};

/// Name of a parameter in Python: half_width for half-width, from_ for from.
[[nodiscard]] std::string pythonName(const std::string& param);

/// Builds the node of an operator call. Arguments are checked like those of a chain: first
/// operands, then parameters with a position, then parameters by name. No operator runs.
/// @param action  index in pipeline::operators()
/// @throws levelset::UsageError for invalid arguments
[[nodiscard]] LazyPtr makeNode(std::size_t action, const pybind11::args& args,
                               const pybind11::kwargs& kwargs);

}  // namespace python
