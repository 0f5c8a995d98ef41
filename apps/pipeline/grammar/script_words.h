#pragma once

#include <cstddef>
#include <string>
#include <vector>

/// The text of a script as lines of words, in which variables are not yet replaced.
namespace pipeline {

struct WordPart {
  std::string text = {};  ///< as it stands, or what stands between ${ and }
  bool isVariable = false;
  bool isQuoted = false;  ///< is neither split nor a pattern nor a number
};

using ScriptWord = std::vector<WordPart>;

struct ScriptLine {
  std::size_t number = 0;  ///< where it begins, from 1
  std::vector<ScriptWord> words;
};

/// Words are split at blanks; '…', "…" and backslashes quote as in a shell; # begins a comment; a
/// backslash at the end of a line joins the next to it. ${…} is a variable, but not in '…', and not
/// as \${ or $${. Lines without a word are left out.
/// @param name  of the file, for the errors
/// @throws levelset::UsageError for a quote or a ${ that is not closed
[[nodiscard]] std::vector<ScriptLine> splitScript(const std::string& text, const std::string& name);

}  // namespace pipeline
