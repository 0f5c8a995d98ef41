#pragma once

#include <cstddef>
#include <functional>
#include <limits>

namespace levelset {

/// Callback through which long operators report their progress, a fraction in [0, 1] that never
/// decreases. It returns false to cancel; the operator then throws Cancelled and leaves no partial
/// result. Calls come one at a time, but not always from the thread that called the operator.
/// Empty: no reports.
using Progress = std::function<bool(double)>;

/// Reports the fraction.
/// @throws Cancelled when `progress` is set and returns false
void report(const Progress& progress, double fraction);

/// Maps the progress of a subtask, 0 to 1, to the interval [from, to] of the complete task.
[[nodiscard]] Progress subProgress(const Progress& whole, double from, double to);

/// Value for "no limit" of the bytes that an operator may use. Operators estimate their memory and
/// throw ResourceLimit before they allocate.
inline constexpr std::size_t kNoMemoryLimit = std::numeric_limits<std::size_t>::max();

/// Compares a memory estimate with its limit.
/// @throws ResourceLimit, with both figures, when `estimatedBytes` exceeds `maxBytes`
void requireMemory(double estimatedBytes, std::size_t maxBytes);

}  // namespace levelset
