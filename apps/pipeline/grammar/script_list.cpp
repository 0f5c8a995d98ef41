#include "apps/pipeline/grammar/script_list.h"

#include <dirent.h>
#include <fmt/core.h>
#include <glob.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <optional>

#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::IoError;
using levelset::UsageError;

/// Number of decimal digits that always fit into 64 bits.
constexpr std::size_t kMostDigits = 18;

/// An exact decimal number: digits / 10^decimals.
struct Decimal {
  long long digits = 0;
  std::size_t decimals = 0;
  std::size_t whole = 0;  ///< number of digits before the point
  bool isPadded = false;  ///< the text has leading zeros
};

std::optional<Decimal> parseDecimal(const std::string& text) {
  Decimal number;
  const bool isNegative = text.starts_with('-');
  const std::size_t begin = isNegative || text.starts_with('+') ? 1 : 0;
  const std::size_t point = std::min(text.find('.', begin), text.size());
  std::size_t count = 0;
  for (std::size_t i = begin; i < text.size(); ++i) {
    if (i == point) continue;
    if (text[i] < '0' || text[i] > '9' || ++count > kMostDigits) return std::nullopt;
    number.digits = 10 * number.digits + (text[i] - '0');
  }
  if (count == 0) return std::nullopt;
  if (isNegative) number.digits = -number.digits;
  number.decimals = point == text.size() ? 0 : text.size() - point - 1;
  number.whole = point - begin;
  number.isPadded = number.whole > 1 && text[begin] == '0';
  return number;
}

std::string decimalText(long long digits, std::size_t decimals, std::size_t width) {
  std::string text = std::to_string(digits < 0 ? -digits : digits);
  text.insert(0, std::max(decimals + 1, text.size()) - text.size(), '0');
  std::string fraction = text.substr(text.size() - decimals);
  std::string whole = text.substr(0, text.size() - decimals);
  while (fraction.ends_with('0')) fraction.pop_back();
  whole.insert(0, std::max(width, whole.size()) - whole.size(), '0');
  return (digits < 0 ? "-" : "") + whole + (fraction.empty() ? "" : "." + fraction);
}

/// Decides if a word is a range such as 0..10. A number must precede the two points, because a file
/// name may contain two points too: "../a.ply".
bool looksLikeRange(const ListWord& word) {
  const std::size_t points = word.isBare ? word.text.find("..") : std::string::npos;
  return points != std::string::npos && parseDecimal(word.text.substr(0, points));
}

std::vector<std::string> rangeValues(const std::string& range, const std::string& stepText,
                                     std::size_t most, const std::string& where) {
  const std::size_t points = range.find("..");
  const std::string written = stepText.empty() ? range : range + " step " + stepText;
  std::optional<Decimal> from = parseDecimal(range.substr(0, points)),
                         to = parseDecimal(range.substr(points + 2)),
                         step = parseDecimal(stepText.empty() ? "1" : stepText);
  if (!from || !to || !step) {
    throw UsageError(fmt::format(
        "{}: '{}' is not a range; write it as 0..10 or 0..1 step 0.25, with plain decimals of at "
        "most {} digits",
        where, written, kMostDigits));
  }
  const std::size_t decimals = std::max({from->decimals, to->decimals, step->decimals});
  std::size_t width = 1;
  for (Decimal* number : {&*from, &*to, &*step}) {
    if (number->whole + decimals > kMostDigits) {
      throw UsageError(fmt::format("{}: '{}' has numbers of more than {} digits; use fewer", where,
                                   written, kMostDigits));
    }
    for (std::size_t i = number->decimals; i < decimals; ++i) number->digits *= 10;
    if (number != &*step && (from->isPadded || to->isPadded))
      width = std::max(width, number->whole);
  }
  const long long length = to->digits - from->digits;
  if (step->digits == 0)
    throw UsageError(fmt::format("{}: '{}' never ends; give a step other than 0", where, written));
  if (length != 0 && (length > 0) != (step->digits > 0)) {
    throw UsageError(
        fmt::format("{}: '{}' never reaches its end; use a step of the other "
                    "sign, as in 10..0 step -1",
                    where, written));
  }
  const auto count = static_cast<std::size_t>(length / step->digits) + 1;
  if (count > most)
    throw UsageError(
        fmt::format("{}: '{}' has more than {} numbers; make it shorter", where, written, most));
  std::vector<std::string> values;
  for (std::size_t i = 0; i < count; ++i)
    values.push_back(
        decimalText(from->digits + static_cast<long long>(i) * step->digits, decimals, width));
  return values;
}

// glob() passes no user data to its callbacks, so they share this variable.
thread_local FolderBudget* globBudget = nullptr;

void* openFolder(const char* name) {
  errno = ENFILE;  // glob() passes this value to refuseFolder()
  if (globBudget->folders == 0 || globBudget->entries == 0) return nullptr;
  --globBudget->folders;
  return ::opendir(name);
}

dirent* nextEntry(void* folder) {
  if (globBudget->entries == 0) return nullptr;
  --globBudget->entries;
  return ::readdir(static_cast<DIR*>(folder));
}

bool mayLookUp() {
  if (globBudget->names == 0) return false;
  --globBudget->names;
  return true;
}

/// Error callback of glob(). Ends the search when the budget is used up, which openFolder() reports
/// as ENFILE. Ignores folders that cannot be read.
int refuseFolder(const char*, int error) {
  return error == ENFILE ? 1 : 0;
}

std::vector<std::string> matchingFiles(const std::string& pattern, FolderBudget* budget,
                                       const std::string& where) {
  glob_t found{};
  found.gl_opendir = openFolder;
  found.gl_readdir = nextEntry;
  found.gl_closedir = [](void* folder) { ::closedir(static_cast<DIR*>(folder)); };
  found.gl_stat = [](const char* name, struct stat* about) {
    return mayLookUp() ? ::stat(name, about) : -1;
  };
  found.gl_lstat = [](const char* name, struct stat* about) {
    return mayLookUp() ? ::lstat(name, about) : -1;
  };
  globBudget = budget;
  const int status = glob(pattern.c_str(), GLOB_NOSORT | GLOB_ALTDIRFUNC, refuseFolder, &found);
  std::vector<std::string> files(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  globfree(&found);
  if (status == GLOB_ABORTED || budget->entries == 0 || budget->names == 0)
    throw UsageError(fmt::format(
        "{}: '{}' visits too many folders and files; name the folder, and use fewer wildcards",
        where, pattern));
  if (status == 0) {
    std::sort(files.begin(), files.end());  // by bytes, independent of the locale
    return files;
  }
  throw IoError(fmt::format(
      "{}: {} '{}'; check the names and the folder, or quote it if it is not "
      "a pattern",
      where, status == GLOB_NOMATCH ? "no file matches" : "no folder can be read for", pattern));
}

}  // namespace

std::vector<std::string> loopValues(const std::vector<ListWord>& words, const ListLimits& limits,
                                    const std::string& where) {
  std::vector<std::string> values;
  const auto add = [&](const std::vector<std::string>& more) {
    values.insert(values.end(), more.begin(), more.end());
  };
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (looksLikeRange(words[i])) {
      const std::string& range = words[i].text;
      const bool hasStep =
          i + 1 < words.size() && words[i + 1].isBare && words[i + 1].text == "step";
      const std::string step = i + 2 < words.size() ? words[i + 2].text : "…";
      add(rangeValues(range, hasStep ? step : "", limits.mostNumbers, where));
      if (hasStep) i += 2;
    } else if (!words[i].pattern.empty()) {
      add(matchingFiles(words[i].pattern, limits.budget, where));
    } else {
      values.push_back(words[i].text);
    }
  }
  return values;
}

}  // namespace pipeline
