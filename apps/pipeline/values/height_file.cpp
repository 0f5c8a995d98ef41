#include "apps/pipeline/values/height_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string>

#include "levelset/error.h"
#include "render/images/grey_image.h"

namespace pipeline {
namespace {

using levelset::InvalidInput;

constexpr const char* kHeights = "heightmap";

std::ifstream openHeights(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  std::error_code ignored;
  const bool isFolder = std::filesystem::is_directory(path, ignored);
  if (in && !isFolder) return in;
  throw levelset::IoError(fmt::format("{}: '{}': {}; check the path", kHeights, path.string(),
                                      isFolder ? "is a folder" : std::strerror(errno)));
}

/// Recognizes a PNG by its first byte, with which no text begins. Only this byte is inspected,
/// because a pipe cannot be rewound.
bool isPng(std::istream& in) {
  return in.peek() == 0x89;
}

mapping::HeightGrid fromPicture(const std::filesystem::path& path, bool invert,
                                std::size_t maxMemory) {
  render::GreyImage image = render::readGreyPng(path, maxMemory);
  for (double& value : image.values)
    if (invert) value = 1 - value;
  for (std::size_t i = 0; i < image.alpha.size(); ++i) image.values[i] *= image.alpha[i];
  return {image.width, image.height, std::move(image.values)};
}

/// Appends the numbers of a line.
/// @param where  prefix of the error message
void readLine(const std::string& line, const std::string& where, std::vector<double>& numbers) {
  constexpr const char* kBetween = " \t\r,;";
  for (std::size_t at = line.find_first_not_of(kBetween); at != std::string::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBetween, at), line.size());
    double number = 0;
    const char *first = line.data() + at + (line[at] == '+'), *last = line.data() + end;
    const auto [stop, error] = std::from_chars(first, last, number);
    if (error != std::errc() || stop != last || !std::isfinite(number)) {
      throw InvalidInput(
          fmt::format("{}: '{}' is not a finite number; give a grey PNG or lines of "
                      "numbers",
                      where, line.substr(at, std::min<std::size_t>(end - at, 40))));
    }
    numbers.push_back(number);
    at = line.find_first_not_of(kBetween, end);
  }
}

mapping::HeightGrid fromNumbers(std::istream& in, const std::string& name, bool invert,
                                std::size_t maxMemory) {
  mapping::HeightGrid grid;
  std::string line;
  for (int row = 1; std::getline(in, line); ++row) {
    const std::size_t before = grid.heights.size();
    const std::string where = fmt::format("{}: '{}', line {}", kHeights, name, row);
    readLine(line, where, grid.heights);
    levelset::withContext(where, [&] {
      levelset::requireMemory(static_cast<double>(grid.heights.size() * sizeof(double)), maxMemory);
    });
    const auto count = static_cast<int>(grid.heights.size() - before);
    if (count == 0) continue;
    if (grid.rows > 0 && count != grid.columns) {
      throw InvalidInput(fmt::format(
          "{}: the line has {} numbers, but earlier lines have {}; give equally many in "
          "each line",
          where, count, grid.columns));
    }
    grid.columns = count;
    ++grid.rows;
  }
  if (grid.heights.empty())
    throw InvalidInput(
        fmt::format("{}: '{}' is empty; give a grey PNG or lines of numbers", kHeights, name));
  const auto [least, most] = std::minmax_element(grid.heights.begin(), grid.heights.end());
  const double low = *least, range = *most - *least;
  for (double& height : grid.heights) {
    height = range > 0 ? (height - low) / range : 0;
    if (invert) height = 1 - height;
  }
  return grid;
}

}  // namespace

mapping::HeightGrid readHeights(const std::filesystem::path& path, bool invert,
                                std::size_t maxMemory) {
  std::ifstream in = openHeights(path);
  mapping::HeightGrid grid = isPng(in) ? fromPicture(path, invert, maxMemory)
                                       : fromNumbers(in, path.string(), invert, maxMemory);
  if (grid.columns < 2 || grid.rows < 2) {
    throw InvalidInput(fmt::format("{}: '{}' has {} columns and {} rows; give at least two of each",
                                   kHeights, path.string(), grid.columns, grid.rows));
  }
  return grid;
}

}  // namespace pipeline
