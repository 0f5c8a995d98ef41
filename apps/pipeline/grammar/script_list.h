#pragma once

#include <cstddef>
#include <string>
#include <vector>

/// Values of the loop variables of scripts.
namespace pipeline {

/// A word of the list after `for NAME in`, with its variables replaced.
struct ListWord {
  std::string text;
  std::string pattern = {};  ///< file name pattern; empty: the word has no unquoted * ? or [
  bool isBare = true;        ///< has no quotes, so it may be a range
};

/// Numbers of folders, folder entries and names that glob() may still visit. A pattern such as
/// `/*/../*/../*` visits each folder again in every folder, and the time of glob() grows with the
/// square of the number of folders.
struct FolderBudget {
  std::size_t folders = 2048, entries = 1 << 20;
  /// Literal path components after a wildcard, such as `..`; each is looked up.
  std::size_t names = 8192;
};

struct ListLimits {
  std::size_t mostNumbers = 0;     ///< largest number of values of a range
  FolderBudget* budget = nullptr;  ///< shared by all loops of a script
};

/// Lists the values that the variable of a loop takes. `A..B` gives the numbers from A to B, and
/// `A..B step S` those with step S. Numbers are exact decimals, padded with zeros if A or B is. A
/// pattern gives the sorted names of the matching files. Any other word gives itself.
/// @param where  prefix of each error message
/// @throws levelset::UsageError for a wrong range, or if a limit is exceeded
/// @throws levelset::IoError if no file matches a pattern
[[nodiscard]] std::vector<std::string> loopValues(const std::vector<ListWord>& words,
                                                  const ListLimits& limits,
                                                  const std::string& where);

}  // namespace pipeline
