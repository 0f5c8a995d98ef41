#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "levelset/terrain/height_field.h"

/// Reads and writes height fields: ESRI ASCII grids (`.asc`), tiles of the Shuttle Radar Topography
/// Mission (`.hgt`), and numbers with an ESRI header beside them (`.flt`, `.bil`, with `.hdr`).
/// Where GDAL is found, also GeoTIFF (`.tif`, `.tiff`), `.dem` and DTED (`.dt0` to `.dt2`).
namespace levelset {

struct ReadHeightFieldOptions {
  std::string format = {};  ///< extension of the format; empty: that of the file
  std::size_t maxMemory = kNoMemoryLimit;
  std::vector<std::string>* notes = nullptr;  ///< receives remarks about the file; may be null
  Progress progress = {};
};

/// Reads a height field. Heights are rounded to the 24 bits of float. Samples with the file's
/// number for missing data become NaN. The positions of ASCII and binary grids are those of the
/// centres of their cells. The name of the coordinate system comes from the `.prj` file beside
/// the grid, if there is one. A `.hgt` file has its latitude and longitude in its name, such as
/// N37W123.hgt.
/// @throws UsageError for an unknown format, or one that needs GDAL in a build without it
/// @throws IoError when a file cannot be opened
/// @throws InvalidInput for a damaged header, for a file that is shorter or longer than its header
///         states, and for a number that is not finite
/// @throws ResourceLimit before the heights exceed maxMemory or the machine's memory
[[nodiscard]] HeightField readHeightField(const std::filesystem::path& path,
                                          const ReadHeightFieldOptions& options = {});

[[nodiscard]] bool isHeightFormat(const std::filesystem::path& nameOrFormat);
/// Returns true for the name of an ASCII grid, and for "asc". It is the format that
/// writeHeightField() writes.
[[nodiscard]] bool isAsciiGridFormat(const std::filesystem::path& nameOrFormat);

struct WriteHeightFieldOptions {
  Progress progress = {};
};

/// Writes an ESRI ASCII grid, with the shortest numbers that read back as the same floats. Missing
/// samples get the number noData, or −9999, or a smaller number if a sample has that height. A
/// field with different spacings along x and y gets `dx` and `dy` in place of `cellsize`, which
/// GDAL reads, too. The coordinate system is not written.
/// @throws InvalidInput for a field that requireHeights() refuses
/// @throws IoError, Cancelled
void writeHeightField(const std::filesystem::path& path, const HeightField& field,
                      const WriteHeightFieldOptions& options = {});

}  // namespace levelset
