#pragma once

#include <cstddef>
#include <functional>
#include <limits>

namespace levelset {

/// Callback to which long operators report their progress, a fraction in [0, 1] that never
/// decreases. It returns false to cancel; the operator then throws Cancelled and leaves no partial
/// result. Operators never call it from two threads at once, but may call it from another thread
/// than the one that called the operator. An empty function: no reports.
using Progress = std::function<bool(double)>;

/// Calls `progress` with the fraction, unless it is empty.
/// @throws Cancelled when `progress` is set and returns false
void report(const Progress& progress, double fraction);

/// Returns a callback for a subtask. It maps the fraction of the subtask, 0 to 1, to the interval
/// [from, to] of the complete task.
[[nodiscard]] Progress subProgress(const Progress& whole, double from, double to);

/// Returns a callback that passes the largest fraction so far on, for tasks whose parts report
/// overlapping intervals.
[[nodiscard]] Progress monotonicProgress(const Progress& progress);

/// Value of a `maxMemory` option that means "no limit". Options of that name limit the bytes that
/// an operator may use. Operators estimate their memory and throw ResourceLimit before they
/// allocate.
inline constexpr std::size_t kNoMemoryLimit = std::numeric_limits<std::size_t>::max();

/// Compares a memory estimate with its limit.
/// @throws ResourceLimit, with both numbers, when `estimatedBytes` exceeds `maxBytes`
void requireMemory(double estimatedBytes, std::size_t maxBytes);

}  // namespace levelset
