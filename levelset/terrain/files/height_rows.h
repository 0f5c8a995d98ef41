#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "levelset/terrain/height_field.h"

/// Rows of a ground, one after another, so that the ground need not fit into memory.
namespace levelset {

/// Source of the rows of a ground. Each row is read once, in the order of the source.
class HeightRows {
 public:
  HeightRows() = default;
  HeightRows(const HeightRows&) = delete;
  HeightRows& operator=(const HeightRows&) = delete;
  virtual ~HeightRows() = default;

  /// Size, place and coordinate system of the ground; without heights.
  [[nodiscard]] virtual const HeightField& grid() const = 0;
  /// Returns true if the first row is that of greatest y.
  [[nodiscard]] virtual bool isNorthFirst() const = 0;
  /// Reads the next row. Missing samples are NaN.
  /// @param heights  grid().columns floats
  /// @return false if no sample of the row is known; the heights are undefined then
  /// @throws InvalidInput for damaged data
  virtual bool next(std::span<float> heights) = 0;
  /// Memory that the source holds, bytes. Pages of a mapped file do not count.
  [[nodiscard]] virtual std::size_t memoryUse() const { return 0; }
};

/// Gives the rows of a field, from the south. @param field  lives as long as the result
[[nodiscard]] std::unique_ptr<HeightRows> rowsOf(const HeightField& field);

struct HeightRowsOptions {
  std::string format = {};  ///< extension of the format; empty: that of the file
  std::size_t maxMemory = kNoMemoryLimit;
};

/// Returns true for the formats that openHeightRows() reads: asc, hgt, flt and bil.
[[nodiscard]] bool isRowFormat(const std::filesystem::path& nameOrFormat);

/// Opens a file that readHeightField() reads, with the same errors. Only the pages of the file that
/// are in use are in memory.
[[nodiscard]] std::unique_ptr<HeightRows> openHeightRows(const std::filesystem::path& path,
                                                         const HeightRowsOptions& options = {});

/// Contents of a file of heights without a header.
struct RawHeights {
  int columns = 0, rows = 0;
  /// Type of the numbers: u8, i8, u16, i16, u32, i32, f32 or f64.
  std::string type = "i16";
  bool isBigEndian = false;
  bool isNorthFirst = false;  ///< the first row is that of greatest y
  std::size_t skip = 0;       ///< number of bytes before the first number
  Imath::V2d origin = Imath::V2d(0), spacing = Imath::V2d(1);
  std::optional<double> noData = {};  ///< number of missing samples; NaN is missing, too, if given
  std::size_t maxMemory = kNoMemoryLimit;  ///< for files that cannot be mapped
};

/// Opens a file of numbers.
/// @throws UsageError for a type or a size that is not supported
/// @throws IoError
/// @throws InvalidInput when the file has another number of bytes
[[nodiscard]] std::unique_ptr<HeightRows> openRawHeightRows(const std::filesystem::path& path,
                                                            const RawHeights& raw);

}  // namespace levelset
