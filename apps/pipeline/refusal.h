#pragma once

#include <string>

#include "levelset/error.h"

namespace pipeline {

/// `sentence` as one of `who`: "union: operand 1 …" is that already, "read: 'x.ply' is empty" of a
/// reader deeper down becomes "info: 'x.ply' is empty".
[[nodiscard]] std::string sentenceOf(const std::string& who, std::string sentence);

/// A refusal from deeper down, told as one of what the user wrote: an action, or an option.
[[noreturn]] void refuseAs(const std::string& who, const levelset::Error& error);

}  // namespace pipeline
