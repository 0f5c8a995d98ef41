#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace pipeline {

/// The expanded words of a script, a file with one action on each line.
struct Script {
  std::vector<std::string> words;  ///< as on the command line, with `!` between actions
  // One entry per expanded line; a line in a loop has one entry per iteration.
  std::vector<std::size_t> begins;     ///< index in `words` of the first word of the line
  std::vector<std::string> locations;  ///< position of the line, "FILE, line 4, i = 2"

  /// Returns the position in the script of a word, given by its index in `words`.
  [[nodiscard]] const std::string& location(std::size_t word) const;
};

/// Reads a script, splits it as splitScript() does, replaces its variables and expands its loops.
/// The statements are `set NAME VALUE`, `repeat COUNT [as NAME]` and `for NAME in LIST`; `end` ends
/// a loop. Lines of options before the first action are global options.
/// @param file      path, or "-" for standard input
/// @param settings  values of variables by name; they override those of `set`
/// @throws levelset::IoError if the file cannot be read, or no file matches a pattern
/// @throws levelset::UsageError for a syntax error, a variable without a value, a value in
///         `settings` for an unknown variable, a script without an action, or one that exceeds a
///         limit
[[nodiscard]] Script readScript(const std::filesystem::path& file,
                                const std::map<std::string, std::string>& settings = {});
/// Expands the text of a script, as readScript() does.
/// @param name  name of the script, for error messages
[[nodiscard]] Script expandScript(const std::string& text, const std::string& name,
                                  const std::map<std::string, std::string>& settings = {});

}  // namespace pipeline
