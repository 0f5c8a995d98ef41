#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "apps/python/lazy.h"

namespace python {

/// A lazy value as a Python object has it.
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

/// The name of a parameter as Python writes it: half_width, from_.
[[nodiscard]] std::string pythonName(const std::string& param);

/// A call of an operator, checked as a chain's would be: operands first, then values of parameters
/// that have a place, then all others by name. Nothing runs.
/// @param action  its number in the registry
/// @throws levelset::UsageError
[[nodiscard]] LazyPtr makeNode(std::size_t action, const pybind11::args& args,
                               const pybind11::kwargs& kwargs);

}  // namespace python
