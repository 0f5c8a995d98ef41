#pragma once

#include <cstddef>
#include <string>

namespace cli {

/// From here on a thread of its own watches for Ctrl-C and for memory: temporary files are removed
/// and the process ends at once, with 130 when interrupted and 4 when the resident set passes
/// `maxBytes`. Call it before any other thread is started: signals are blocked in all that follow.
void startWatch(std::size_t maxBytes);

/// Names the action that runs now, for the sentence that ends it.
void tellAction(const std::string& action);

/// 80 % of the memory that is free now.
[[nodiscard]] std::size_t defaultMemoryLimit();

}  // namespace cli
