#pragma once

#include <cstddef>
#include <functional>
#include <limits>

namespace levelset {

/// Called by long operators with a fraction in [0, 1] that never falls; return false to cancel,
/// upon which the operator throws Cancelled and leaves nothing behind. Calls come one at a time,
/// though not always from the thread that called the operator. Empty: nobody asks.
using Progress = std::function<bool(double)>;

/// Throws Cancelled if `progress` is set and answers false.
void report(const Progress& progress, double fraction, const char* action);

/// The part [from, to] of a longer job, as a Progress of its own.
[[nodiscard]] Progress subProgress(const Progress& whole, double from, double to);

/// Bytes that an operator may plan to use; operators estimate first and throw ResourceLimit before
/// they allocate.
inline constexpr std::size_t kNoMemoryLimit = std::numeric_limits<std::size_t>::max();

/// Throws ResourceLimit, naming both figures, if `estimatedBytes` passes `maxBytes`.
void requireMemory(double estimatedBytes, std::size_t maxBytes, const char* action);

}  // namespace levelset
