#pragma once

#include <cstddef>
#include <string>

#include "apps/pipeline/values/value.h"

namespace pipeline {

inline constexpr int kThumbnailWidth = 160, kThumbnailHeight = 120;  ///< pixels
/// So many steps of a run have one: a page of more is slow to open.
inline constexpr std::size_t kMostThumbnails = 100;

/// A small picture of a value, for people who look through a report.
struct Thumbnail {
  std::string png;      ///< the bytes of the file; empty: there is none
  std::string missing;  ///< why, in a few words
};

/// Draws level sets, meshes and scenes on the processor, from the front, right and above, or as a
/// scene is seen. What cannot be drawn, or would pass the limit beside what the process holds, is
/// left out: a run does not fail for want of a picture. The bytes depend on the value alone.
/// @param maxMemory  of the process
[[nodiscard]] Thumbnail thumbnailOf(const Value& value, std::size_t maxMemory);

}  // namespace pipeline
