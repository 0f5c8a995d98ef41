#pragma once

#include <exception>
#include <string>

#include "levelset/error.h"

namespace pipeline {

/// Decides if std::thread or TBB threw `error` because the system gives no more threads.
[[nodiscard]] bool isThreadLimitError(const std::exception& error);
/// Error message for a failure to start a thread, appended to the name of the action or program.
inline constexpr const char* kThreadLimitMessage =
    ": the system gives no more threads; raise its limits (ulimit -u, -v), or use fewer --threads";

/// Adds the prefix "who: " to a message that does not have it.
[[nodiscard]] std::string sentenceOf(const std::string& who, std::string sentence);

/// Appends a position in a script to a message; appends nothing if the position is empty.
[[nodiscard]] std::string withLocation(const std::string& sentence, const std::string& location);

/// Rethrows an error under the name of the action or option that the user wrote. Keeps its class.
[[noreturn]] void rethrowAs(const std::string& who, const levelset::Error& error,
                            const std::string& location = {});

}  // namespace pipeline
