#pragma once

#include <cstddef>
#include <string>
#include <vector>

/// Splits the text of a script into lines of words. Variables are not replaced yet.
namespace pipeline {

/// Part of a word: literal text or one variable.
struct WordPart {
  std::string text = {};  ///< literal text, or the text between ${ and }
  bool isVariable = false;
  /// The part is in quotes: it is not split at blanks, and is no pattern or range.
  bool isQuoted = false;
};

using ScriptWord = std::vector<WordPart>;

struct ScriptLine {
  std::size_t number = 0;  ///< line number in the file, from 1
  std::vector<ScriptWord> words;
};

/// Splits a script into lines and words. Blanks separate words. '…', "…" and backslashes quote as
/// in a shell. # begins a comment. A backslash at the end of a line joins the next line. ${…} is a
/// variable, except in '…' and after \ or $. Lines without a word are left out.
/// @param name  name of the file, for error messages
/// @throws levelset::UsageError for an unclosed quote or ${
[[nodiscard]] std::vector<ScriptLine> splitScript(const std::string& text, const std::string& name);

}  // namespace pipeline
