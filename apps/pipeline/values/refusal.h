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

/// `sentence`, and where in a script that was; as it is for an empty place.
[[nodiscard]] std::string withPlace(const std::string& sentence, const std::string& place);

/// A refusal from deeper down, told as one of what the user wrote: an action, or an option.
[[noreturn]] void refuseAs(const std::string& who, const levelset::Error& error,
                           const std::string& place = {});

}  // namespace pipeline
