#pragma once

#include <cstddef>
#include <string>
#include <vector>

/// What the loops of scripts go through.
namespace pipeline {

/// A word behind `for NAME in`, its variables replaced.
struct ListWord {
  std::string text;
  std::string pattern = {};  ///< for the names of files, if it has an unquoted * ? or [
  bool isBare = true;        ///< has no quotes: may be a range
};

/// The words themselves; A..B as the numbers from A to B, `A..B step S` by steps, each written as
/// the decimal that it is, and with zeros in front where A or B has them; files for a pattern,
/// sorted.
/// @param most  refuses ranges of more numbers
/// @throws levelset::UsageError whose sentence begins with `where`; levelset::IoError when no file
///         matches a pattern
[[nodiscard]] std::vector<std::string> loopValues(const std::vector<ListWord>& words,
                                                  std::size_t most, const std::string& where);

}  // namespace pipeline
