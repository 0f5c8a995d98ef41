#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "apps/pipeline/registry/invocation.h"

/// Frames and key frames of `animate`.
namespace pipeline {

/// Number of frames, --frames. @throws levelset::UsageError for more than 100,000
[[nodiscard]] std::size_t framesOf(const Invocation& in);

/// Returns the frame of each key: --key-frames, or evenly distributed frames.
/// @param count  number of the keys
/// @param thing  a key in words, "patch"; @param things  its plural
/// @throws levelset::UsageError unless the first key is at frame 0 and each further one is later
[[nodiscard]] std::vector<std::size_t> keyFrames(const Invocation& in, std::size_t count,
                                                 const std::string& thing,
                                                 const std::string& things);

}  // namespace pipeline
