#pragma once

#include <filesystem>

#include "apps/viewer/interaction/progressive_picture.h"

namespace viewer {

/// Writes the displayed colours of a frame to a .png file, or all layers of its picture to an .exr
/// file.
/// @throws levelset::UsageError for another file name extension
/// @throws levelset::IoError when the file cannot be written
void writeScreenshot(const std::filesystem::path& file, const Frame& frame);

/// Checks the file name extension of a screenshot.
/// @param isInterface  true: the screenshot shows the entire window, which has no layers, so only
/// .png is allowed
/// @throws levelset::UsageError for an extension that is not allowed
void requireScreenshotName(const std::filesystem::path& file, bool isInterface);

}  // namespace viewer
