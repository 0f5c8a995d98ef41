#pragma once

#include <cstddef>
#include <string>

namespace cli {

/// Starts a thread that watches for Ctrl-C and for memory use. It ends the process at once and
/// removes temporary files: with exit code 130 on an interrupt, and with 4 when the resident set
/// exceeds `maxBytes`. Call it before any other thread starts, because it blocks signals in all
/// later threads.
void startWatch(std::size_t maxBytes);

/// Sets the name of the running action, for the message at such an end.
void tellAction(const std::string& action);

/// 80 % of the memory that is free now, bytes.
[[nodiscard]] std::size_t defaultMemoryLimit();

}  // namespace cli
