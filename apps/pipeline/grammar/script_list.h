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

/// What patterns may still look at: `/*/../*/../*` finds each folder anew in every folder, and what
/// glob() takes grows with the square of their number.
struct FolderBudget {
  std::size_t folders = 2048, entries = 1 << 20;
  std::size_t names = 8192;  ///< that stand as they are behind a pattern: the `..`
};

struct ListLimits {
  std::size_t mostNumbers = 0;  ///< of a range
  FolderBudget* budget = nullptr;
};

/// The words themselves; A..B as the numbers from A to B, `A..B step S` by steps, each written as
/// the decimal that it is, and with zeros in front where A or B has them; files for a pattern,
/// sorted.
/// @throws levelset::UsageError whose sentence begins with `where`, for what passes the limits too;
///         levelset::IoError when no file matches a pattern
[[nodiscard]] std::vector<std::string> loopValues(const std::vector<ListWord>& words,
                                                  const ListLimits& limits,
                                                  const std::string& where);

}  // namespace pipeline
