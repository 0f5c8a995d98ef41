#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace pipeline {

/// The words of a chain that was written into a file, one action a line.
struct Script {
  std::vector<std::string> words;  ///< as on the command line, with a `!` between actions
  std::vector<std::size_t> lines;  ///< where each word stood, from 1
};

/// Words are split at blanks; '…', "…" and backslashes quote as in a shell; # begins a comment; a
/// backslash at the end of a line joins the next to it. Lines that hold only options, before the
/// first action, are global options.
/// @param file  or "-" for standard input
/// @throws levelset::IoError when it cannot be read; levelset::UsageError for an open quote or a
///         file without an action
[[nodiscard]] Script readScript(const std::filesystem::path& file);

}  // namespace pipeline
