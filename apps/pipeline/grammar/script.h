#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace pipeline {

/// The words of a chain that was written into a file, one action a line.
struct Script {
  std::vector<std::string> words;  ///< as on the command line, with a `!` between actions
  // By line, one that stands in a loop as often as it goes round:
  std::vector<std::size_t> begins;     ///< its first word
  std::vector<std::string> locations;  ///< "FILE, line 4, i = 2"

  /// Where a word stood.
  [[nodiscard]] const std::string& location(std::size_t word) const;
};

/// Reads a script as splitScript() does, replaces its variables and goes through its loops: `set
/// NAME VALUE`, `repeat COUNT [as NAME]` and `for NAME in LIST` up to `end`. Lines that hold only
/// options, before the first action, are global options.
/// @param file      or "-" for standard input
/// @param settings  values of variables, which win over those of `set`
/// @throws levelset::IoError when it cannot be read, or no file matches a pattern;
///         levelset::UsageError for what cannot be understood, a variable without a value, a
///         setting that no variable takes, a file without an action or with too many
[[nodiscard]] Script readScript(const std::filesystem::path& file,
                                const std::map<std::string, std::string>& settings = {});
/// The same of a text. @param name  of the script, for what is said about it
[[nodiscard]] Script expandScript(const std::string& text, const std::string& name,
                                  const std::map<std::string, std::string>& settings = {});

}  // namespace pipeline
