#pragma once

#include <exception>
#include <string>

#include "levelset/error.h"

namespace pipeline {

/// Is it what std::thread or TBB throws when the system gives no more threads?
[[nodiscard]] bool isWantOfThreads(const std::exception& error);
/// What to tell then, after the name of who wanted them.
inline constexpr const char* kWantOfThreads =
    ": the system gives no more threads; raise its limits (ulimit -u, -v), or use fewer --threads";

/// `sentence` as one of `who`: "union: operand 1 …" is that already, "read: 'x.ply' is empty" of a
/// reader deeper down becomes "info: 'x.ply' is empty".
[[nodiscard]] std::string sentenceOf(const std::string& who, std::string sentence);

/// A refusal from deeper down, told as one of what the user wrote: an action, or an option.
[[noreturn]] void refuseAs(const std::string& who, const levelset::Error& error);
/// The same refusal, with the place in a script behind it.
[[noreturn]] void refuseAt(const std::string& place, const levelset::Error& error);

}  // namespace pipeline
