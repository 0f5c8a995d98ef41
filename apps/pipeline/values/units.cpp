#include "apps/pipeline/values/units.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

std::vector<std::string_view> split(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> parts;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> parts = split(text, " \t\n");
  std::erase_if(parts, [](std::string_view part) { return part.empty(); });
  return parts;
}

/// Reads the number at the start of `text` and returns the rest of the text.
std::string_view leadingNumber(std::string_view text, double& number, std::string_view where) {
  std::string_view digits = text;
  if (digits.starts_with('+')) digits.remove_prefix(1);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc() || !std::isfinite(number)) {
    throw UsageError(
        fmt::format("{}: '{}' is not a finite number; write it like 0.5 or -2e3", where, text));
  }
  return digits.substr(static_cast<std::size_t>(end - digits.data()));
}

std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitute = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitute});
    }
  }
  return row.back();
}

}  // namespace

double parseNumber(std::string_view text, std::string_view where) {
  double number = 0;
  if (!leadingNumber(text, number, where).empty()) {
    throw UsageError(
        fmt::format("{}: '{}' is not a number; write it like 0.5 or -2e3", where, text));
  }
  return number;
}

long parseInteger(std::string_view text, std::string_view where) {
  long number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw UsageError(
        fmt::format("{}: '{}' is not a whole number; write it like 3 or -2", where, text));
  }
  return number;
}

Length parseLength(std::string_view text, std::string_view where) {
  Length length;
  const std::string_view unit = leadingNumber(text, length.number, where);
  if (unit == "vx") {
    length.unit = Unit::Voxels;
  } else if (unit == "%") {
    length.unit = Unit::Percent;
  } else if (!unit.empty() && unit != "mm") {
    throw UsageError(
        fmt::format("{}: '{}' has an unknown unit '{}'; a length is 0.5 or 0.5mm (world units), "
                    "2vx (voxels) or 1% (of the diagonal)",
                    where, text, unit));
  }
  return length;
}

Imath::V3d parsePoint(std::string_view text, std::string_view where) {
  const std::vector<std::string_view> parts = split(text, ",");
  if (parts.size() != 3) {
    throw UsageError(fmt::format("{}: '{}' is not a point; write it as x,y,z", where, text));
  }
  return {parseNumber(parts[0], where), parseNumber(parts[1], where), parseNumber(parts[2], where)};
}

std::vector<Imath::V3d> parsePoints(std::string_view text, std::string_view where) {
  std::vector<Imath::V3d> points;
  for (std::string_view word : words(text)) points.push_back(parsePoint(word, where));
  return points;
}

Imath::Box3d parseBox(std::string_view text, std::string_view where) {
  const std::vector<Imath::V3d> points = parsePoints(text, where);
  if (points.size() != 2) {
    throw UsageError(
        fmt::format("{}: '{}' is not a box; write it as \"x,y,z x,y,z\"", where, text));
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!(points[0][axis] < points[1][axis])) {
      throw UsageError(
          fmt::format("{}: the box '{}' is empty; its first corner must lie below its second "
                      "on every axis",
                      where, text));
    }
  }
  return {points[0], points[1]};
}

std::pair<int, int> parseImageSize(std::string_view text, std::string_view where) {
  const std::vector<std::string_view> parts = split(text, "x");
  if (parts.size() != 2) {
    throw UsageError(
        fmt::format("{}: '{}' is not an image size; write it as 1024x768", where, text));
  }
  const long width = parseInteger(parts[0], where), height = parseInteger(parts[1], where);
  if (width < 1 || height < 1) {
    throw UsageError(
        fmt::format("{}: an image of {} pixels is empty; both sides must be at "
                    "least 1",
                    where, text));
  }
  if (width > (1L << 20) || height > (1L << 20)) {
    throw levelset::ResourceLimit(fmt::format(
        "{}: an image of {} pixels is too large; a side has at most 1048576", where, text));
  }
  return {static_cast<int>(width), static_cast<int>(height)};
}

std::vector<Length> parseLengths(std::string_view text, std::size_t count, std::string_view where) {
  const std::vector<std::string_view> parts = split(text, ",");
  if (parts.size() != count) {
    throw UsageError(fmt::format("{}: '{}' is not a size; write it as {}", where, text,
                                 count == 2 ? "a,b" : "a,b,c"));
  }
  std::vector<Length> lengths;
  for (std::string_view part : parts) lengths.push_back(parseLength(part, where));
  return lengths;
}

std::size_t parseBytes(std::string_view text, std::string_view where) {
  double number = 0;
  const std::string_view unit = leadingNumber(text, number, where);
  constexpr std::string_view kUnits = "KMGT";
  double factor = 1;
  if (!unit.empty()) {
    const std::size_t power =
        kUnits.find(static_cast<char>(std::toupper(static_cast<unsigned char>(unit[0]))));
    const std::string_view rest = unit.substr(1);
    if (power == std::string_view::npos || !(rest.empty() || rest == "B" || rest == "iB")) {
      throw UsageError(fmt::format("{}: '{}' is not an amount of memory; write it like 4G or 512M",
                                   where, text));
    }
    factor = std::pow(1024.0, static_cast<double>(power + 1));
  }
  const double bytes = number * factor;
  if (!(bytes >= 1) || bytes > 1e18) {
    throw UsageError(fmt::format(
        "{}: '{}' is not a possible amount of memory; write it like 4G or 512M", where, text));
  }
  return static_cast<std::size_t>(bytes);
}

std::vector<double> parseNumbers(std::string_view text, std::string_view where) {
  std::vector<double> numbers;
  for (std::string_view part : split(text, ",")) numbers.push_back(parseNumber(part, where));
  if (numbers.size() != 1 && numbers.size() != 3) {
    throw UsageError(fmt::format("{}: '{}' must be one number, or three as x,y,z", where, text));
  }
  return numbers;
}

Imath::M44d parseMatrix(std::string_view text, std::string_view where) {
  std::vector<double> numbers;
  for (std::string_view part : split(text, ", \t\n"))
    if (!part.empty()) numbers.push_back(parseNumber(part, where));
  const std::size_t columns = numbers.size() == 12 ? 3 : 4;
  if (numbers.size() != 12 && numbers.size() != 16) {
    throw UsageError(
        fmt::format("{}: a matrix has 16 numbers row by row, or 12 without the last column; "
                    "this one has {}",
                    where, numbers.size()));
  }
  Imath::M44d matrix;
  for (std::size_t i = 0; i < numbers.size(); ++i)
    matrix[static_cast<int>(i / columns)][static_cast<int>(i % columns)] = numbers[i];
  if (matrix[0][3] != 0 || matrix[1][3] != 0 || matrix[2][3] != 0 || matrix[3][3] != 1) {
    throw UsageError(
        fmt::format("{}: the last column must be 0 0 0 1; points are row vectors and the "
                    "translation is the last row",
                    where));
  }
  return matrix;
}

std::string didYouMean(std::string_view word, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t bestDistance = 1 + word.size() / 3;
  for (const std::string& candidate : candidates) {
    if (word.size() >= 3 && candidate.starts_with(word)) return candidate;
    const std::size_t distance = editDistance(word, candidate);
    if (distance <= bestDistance && (best.empty() || distance < bestDistance)) {
      best = candidate;
      bestDistance = distance;
    }
  }
  return best;
}

}  // namespace pipeline
