#pragma once

#include <cstddef>
#include <string>

namespace cli {

/// Starts a thread that watches for signals (Ctrl-C, SIGTERM, SIGHUP) and for memory use. On a
/// signal, or when the resident set exceeds `maxBytes`, it removes temporary files and ends the
/// process at once. The exit code is 130 for Ctrl-C, 128 plus the signal's number for others, and 4
/// for memory. Call startWatch() before any other thread starts, because it blocks these signals in
/// all later threads.
void startWatch(std::size_t maxBytes);

/// Sets the name of the running action, for the message when memory exceeds the limit.
void tellAction(const std::string& action);

/// Default of --max-memory: 80 % of the memory that is available now, bytes; no limit if it is
/// unknown.
[[nodiscard]] std::size_t defaultMemoryLimit();

}  // namespace cli
