#pragma once

#include <cstddef>

namespace cli {

/// From here on a thread of its own watches for Ctrl-C and for memory: temporary files are removed
/// and the process ends at once, with 130 when interrupted and 4 when the resident set passes
/// `maxBytes`. Call it before any other thread is started: signals are blocked in all that follow.
void startWatch(std::size_t maxBytes);

/// 80 % of the memory that is free now.
[[nodiscard]] std::size_t defaultMemoryLimit();

}  // namespace cli
