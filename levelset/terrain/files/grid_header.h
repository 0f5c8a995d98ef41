#pragma once

// Internal header of levelset: public headers must not include it.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "levelset/terrain/height_field.h"

namespace levelset::terrain {

/// Words of an ESRI header: lines of a name and a value, in any order.
class GridHeader {
 public:
  /// @param name  name of the file in messages, in quotes
  explicit GridHeader(std::string name) : name_(std::move(name)) {}

  /// Takes lines off the text while they begin with a letter.
  /// @return the text behind them
  /// @throws InvalidInput for a name without a value, or a name that occurs twice
  std::string_view take(std::string_view text);

  [[nodiscard]] bool has(const std::string& word) const { return words_.contains(word); }
  /// Value in lower case; empty: not given.
  [[nodiscard]] std::string text(const std::string& word) const;
  /// @throws InvalidInput for a value that is no finite number
  [[nodiscard]] std::optional<double> number(const std::string& word) const;
  /// @throws InvalidInput for a missing value, or one that is not a whole number of least to most
  [[nodiscard]] std::size_t count(const std::string& word, std::size_t least,
                                  std::size_t most) const;
  /// Value of missing samples, as the file writes it; NaN if the file says so.
  [[nodiscard]] std::optional<double> noData() const;

  /// Makes a field without heights of ncols, nrows, xllcorner or xllcenter and so on, and cellsize
  /// or dx and dy; or of ulxmap, ulymap, xdim and ydim.
  [[nodiscard]] HeightField grid() const;
  /// Number of lines taken so far.
  [[nodiscard]] std::size_t lines() const { return lines_; }
  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::string name_;
  std::map<std::string, std::string> words_;  // names and values in lower case
  std::size_t lines_ = 0;
};

/// Sets the coordinate system from the `.prj` file beside a grid, if there is one.
/// @throws InvalidInput for a file that is longer than 64 KiB
void readProjection(const std::filesystem::path& grid, HeightField& field);

/// Checks that the heights fit into memory, before they are allocated.
void requireHeightMemory(const HeightField& field, double otherBytes, std::size_t maxMemory);

/// Lower-case extension of a name, or the name of a format, without a dot.
[[nodiscard]] std::string heightFormatOf(const std::filesystem::path& nameOrFormat);

}  // namespace levelset::terrain
