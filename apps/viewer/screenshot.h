#pragma once

#include <filesystem>

#include "apps/viewer/interaction/progressive_picture.h"

namespace viewer {

/// Writes what a frame shows as a .png, or all of its layers as an .exr.
/// @throws levelset::UsageError for another name; levelset::IoError when it cannot be written
void writeScreenshot(const std::filesystem::path& file, const Frame& frame);

/// @throws levelset::UsageError for a name of no format that writeScreenshot() knows
/// @param isInterface  of the whole window, which has no layers: .png only
void requireScreenshotName(const std::filesystem::path& file, bool isInterface);

}  // namespace viewer
