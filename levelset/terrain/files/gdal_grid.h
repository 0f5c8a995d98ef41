#pragma once

// Internal header of levelset: public headers must not include it.

#include <filesystem>
#include <string_view>

#include "levelset/terrain/files/height_field_file.h"

namespace levelset::terrain {

/// Returns true for the formats that GDAL reads for this library: GeoTIFF (`tif`, `tiff`),
/// elevation models of the United States Geological Survey (`dem`), and DTED (`dt0`, `dt1`, `dt2`).
[[nodiscard]] bool isGdalFormat(std::string_view format);

/// Reads one band of heights by GDAL. The library of GDAL is loaded by the first call, so that
/// programs that read no such file do not pay for it. Scale and offset of the band are applied.
/// Samples with the number for missing data, or outside a mask, become NaN.
/// @param format  isGdalFormat()
/// @throws as readHeightField(); IoError, too, when GDAL is missing
[[nodiscard]] HeightField readGdalGrid(const std::filesystem::path& path, std::string_view format,
                                       const ReadHeightFieldOptions& options);

}  // namespace levelset::terrain
