#pragma once

#include <filesystem>

#include "apps/viewer/interaction/progressive_picture.h"

namespace viewer {

/// Writes the picture of a frame as a .png, or all of its layers as an .exr.
/// @throws levelset::UsageError for another file name extension
/// @throws levelset::IoError when the file cannot be written
void writeScreenshot(const std::filesystem::path& file, const Frame& frame);

/// Checks the extension of a screenshot's file name.
/// @param isInterface  the screenshot is of the entire window, which has no layers: .png only
/// @throws levelset::UsageError for an extension that writeScreenshot() does not support
void requireScreenshotName(const std::filesystem::path& file, bool isInterface);

}  // namespace viewer
