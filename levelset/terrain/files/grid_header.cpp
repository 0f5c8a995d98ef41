#include "levelset/terrain/files/grid_header.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset::terrain {
namespace {

constexpr double kMostGridSize = 1 << 30;

using volume_files::lowered;
using volume_files::numberIn;
using volume_files::takeWord;

}  // namespace

void GridHeader::fail(const std::string& what) const {
  throw InvalidInput(fmt::format("{}: {}", name_, what));
}

std::string_view GridHeader::take(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    std::string_view line = text.substr(0, end);
    const std::string word = lowered(takeWord(line).substr(0, 1000));
    // Numbers, and the word nan, are the first heights.
    if (!word.empty() && (!std::isalpha(static_cast<unsigned char>(word[0])) || word == "nan"))
      return text;
    ++lines_;
    if (!word.empty()) {
      constexpr std::size_t kMostWords = 64;
      const std::string shown = word.substr(0, 40);
      const std::string_view given = takeWord(line);
      constexpr std::size_t kLongestWord = 256;
      if (std::max(word.size(), given.size()) > kLongestWord)
        fail(fmt::format("line {}: '{}…' is no line of a header; check the file", lines_, shown));
      const std::string value = lowered(given);
      if (value.empty())
        fail(fmt::format("line {}: '{}' has no value; repair the header", lines_, shown));
      if (!words_.emplace(word, value).second)
        fail(fmt::format("line {}: '{}' is given twice; repair the header", lines_, shown));
      if (words_.size() > kMostWords)
        fail(fmt::format("the header has more than {} lines; it is no header of a grid",
                         kMostWords));
    }
    text.remove_prefix(end);
    if (text.starts_with("\r\n"))
      text.remove_prefix(2);
    else if (!text.empty())
      text.remove_prefix(1);
  }
  return text;
}

std::string GridHeader::text(const std::string& word) const {
  const auto found = words_.find(word);
  return found == words_.end() ? std::string() : found->second;
}

std::optional<double> GridHeader::number(const std::string& word) const {
  if (!has(word)) return {};
  const std::optional<double> value = numberIn<double>(text(word));
  if (!value || !std::isfinite(*value))
    fail(fmt::format("'{}' of {} is not a finite number; repair the header",
                     text(word).substr(0, 40), word));
  return value;
}

std::size_t GridHeader::count(const std::string& word, std::size_t least, std::size_t most) const {
  const std::optional<double> value = number(word);
  if (!value) fail(fmt::format("the header lacks {}; repair it", word));
  if (!(*value >= static_cast<double>(least) && *value <= static_cast<double>(most)) ||
      std::floor(*value) != *value)
    fail(fmt::format("{} is {}, but it must be a whole number from {} to {}; repair the header",
                     word, *value, least, most));
  return static_cast<std::size_t>(*value);
}

std::optional<double> GridHeader::noData() const {
  for (const char* word : {"nodata_value", "nodata"}) {
    if (!has(word)) continue;
    if (text(word) == "nan" || text(word) == "-nan") return std::nan("");
    return number(word);
  }
  return {};
}

HeightField GridHeader::grid() const {
  HeightField field;
  const auto most = static_cast<std::size_t>(kMostGridSize);
  field.columns = static_cast<int>(count("ncols", 1, most));
  field.rows = static_cast<int>(count("nrows", 1, most));
  field.noData = noData();
  const auto step = [&](const char* own, const char* other) {
    for (const char* word : {"cellsize", own, other})
      if (const std::optional<double> value = number(word)) {
        if (!(*value > 0)) fail(fmt::format("{} is {}, but it must be positive", word, *value));
        return *value;
      }
    fail("the header lacks cellsize; repair it");
  };
  field.spacing = {step("dx", "xdim"), step("dy", "ydim")};
  // The lower left cell by its corner or its centre, or the upper left one by its centre.
  const auto start = [&](const char* corner, const char* centre, double half) {
    if (has(corner) && has(centre))
      fail(fmt::format("the header has both {} and {}; remove one", corner, centre));
    if (const std::optional<double> value = number(corner)) return *value + half;
    return number(centre).value_or(NAN);
  };
  field.origin = {start("xllcorner", "xllcenter", field.spacing.x / 2),
                  start("yllcorner", "yllcenter", field.spacing.y / 2)};
  if (std::isnan(field.origin.x)) field.origin.x = number("ulxmap").value_or(NAN);
  if (std::isnan(field.origin.y) && has("ulymap"))
    field.origin.y = *number("ulymap") - (field.rows - 1) * field.spacing.y;
  if (std::isnan(field.origin.x) || std::isnan(field.origin.y))
    fail("the header lacks the position of the grid, xllcorner and yllcorner; add it");
  return field;
}

void readProjection(const std::filesystem::path& grid, HeightField& field) {
  std::filesystem::path file = grid;
  file.replace_extension(".prj");
  std::error_code error;
  if (grid == "-" || !std::filesystem::is_regular_file(file, error)) return;
  constexpr std::size_t kMostBytes = 1 << 16;
  if (std::filesystem::file_size(file, error) > kMostBytes)
    throw InvalidInput(fmt::format(
        "'{}' is longer than 64 KiB, but it must name a coordinate system; rename or remove it",
        file.string()));
  if (std::filesystem::file_size(file, error) == 0) return;
  const Bytes bytes = readBytes(file, kNoMemoryLimit);
  std::string_view text = bytes.view();
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  std::string_view rest = text;
  const std::string first = lowered(takeWord(rest));
  if (first == "projection") {
    field.coordinateSystem = std::string(takeWord(rest));
    field.isGeographic = lowered(field.coordinateSystem) == "geographic";
    return;
  }
  // Well-known text: its first word tells the kind of system, and the first text is its name.
  const std::size_t quote = text.find('"');
  const std::size_t end = quote == std::string_view::npos ? quote : text.find('"', quote + 1);
  if (end == std::string_view::npos)
    throw InvalidInput(
        fmt::format("'{}' names no coordinate system; rename or remove it", file.string()));
  field.coordinateSystem = std::string(text.substr(quote + 1, end - quote - 1));
  // Compound systems contain a horizontal one. A projected system contains a geographic one.
  const auto contains = [&](std::string_view word) {
    const auto sameLetter = [](char a, char b) {
      return std::toupper(static_cast<unsigned char>(a)) == b;
    };
    return std::search(text.begin(), text.end(), word.begin(), word.end(), sameLetter) !=
           text.end();
  };
  field.isGeographic = (contains("GEOGCS") || contains("GEOGCRS") || contains("GEODCRS")) &&
                       !contains("PROJCS") && !contains("PROJCRS");
}

void requireHeightMemory(const HeightField& field, double otherBytes, std::size_t maxMemory) {
  const double samples = static_cast<double>(field.columns) * static_cast<double>(field.rows);
  requireMemory(samples * sizeof(float) + otherBytes, maxMemory);
}

std::string heightFormatOf(const std::filesystem::path& nameOrFormat) {
  std::string word = nameOrFormat.extension().string();
  if (word.empty()) word = nameOrFormat.string();
  if (word.starts_with('.')) word.erase(0, 1);
  return lowered(word);
}

}  // namespace levelset::terrain
