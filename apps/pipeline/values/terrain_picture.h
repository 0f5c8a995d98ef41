#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "levelset/terrain/height_field.h"

namespace pipeline {

/// Returns true for the name of a PNG, and for "png".
[[nodiscard]] bool isTerrainPicture(const std::string& nameOrFormat);

/// Reads a grey PNG of 1 to 16 bits as heights from 0 (black) to 1 (white), with a spacing of 1.
/// The lowest row of pixels is the first row, at y = 0. Transparent pixels are missing.
/// @throws levelset::InvalidInput for a pixel that is partly transparent, and as
///         render::readGreyPng
/// @throws levelset::IoError, levelset::ResourceLimit
[[nodiscard]] levelset::HeightField readTerrainPicture(const std::filesystem::path& file,
                                                       std::size_t maxMemory);

}  // namespace pipeline
