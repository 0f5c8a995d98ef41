#pragma once

#include <cstddef>
#include <string>

#include "apps/pipeline/values/value.h"

namespace pipeline {

inline constexpr int kThumbnailWidth = 160, kThumbnailHeight = 120;  ///< pixels
/// Largest number of steps of a run that get a thumbnail. A page with more is slow to open.
inline constexpr std::size_t kMostThumbnails = 100;

/// A small picture of a value, shown in the report.
struct Thumbnail {
  std::string png;      ///< bytes of the PNG file; empty: no picture
  std::string missing;  ///< short reason why there is no picture
};

/// Draws a level set, mesh or scene with the CPU renderer. The camera looks from the front, right
/// and above; a scene with a camera uses its own. A value that cannot be drawn gets no picture and
/// a reason, so a run never fails because of a thumbnail. The same holds for a value whose picture
/// would exceed the memory that the limit leaves. The bytes of the picture depend on the value
/// alone.
/// @param maxMemory  memory limit of the process, bytes
[[nodiscard]] Thumbnail thumbnailOf(const Value& value, std::size_t maxMemory);

}  // namespace pipeline
