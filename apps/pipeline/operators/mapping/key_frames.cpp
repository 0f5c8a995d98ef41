#include "apps/pipeline/operators/mapping/key_frames.h"

#include <fmt/core.h>

#include <algorithm>

#include "apps/pipeline/values/units.h"
#include "levelset/error.h"

namespace pipeline {

using levelset::UsageError;

std::size_t framesOf(const Invocation& in) {
  constexpr long kMostFrames = 100000;
  const long frames = in.integer("frames");
  if (frames > kMostFrames)
    throw UsageError(
        fmt::format("animate: --frames {} is too large; give at most {}", frames, kMostFrames));
  return static_cast<std::size_t>(frames);
}

std::vector<std::size_t> keyFrames(const Invocation& in, std::size_t count,
                                   const std::string& thing, const std::string& things) {
  const std::size_t frames = framesOf(in);
  std::vector<std::size_t> keys;
  if (in.given("key-frames")) {
    const std::string text = in.text("key-frames");
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(',', begin), text.size());
      const long frame = parseInteger(text.substr(begin, end - begin), in.where("key-frames"));
      if (frame < 0)
        throw UsageError(fmt::format("{}: frame {} is negative; frames count from 0",
                                     in.where("key-frames"), frame));
      keys.push_back(static_cast<std::size_t>(frame));
      begin = end + 1;
    }
    if (keys.size() != count)
      throw UsageError(
          fmt::format("{}: {} frames are given for {} {}; give one frame for each {}, 0 first",
                      in.where("key-frames"), keys.size(), count, things, thing));
  } else {
    for (std::size_t k = 0; k < count; ++k)
      keys.push_back(count > 1 ? (2 * k * (frames - 1) + count - 1) / (2 * (count - 1)) : 0);
  }
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (keys[k] < frames && (k == 0 ? keys[k] == 0 : keys[k] > keys[k - 1])) continue;
    throw UsageError(fmt::format(
        "animate: {} {} do not fit {} frames: {} {} would be at frame {}; the first {} must be at "
        "frame 0, each further {} at a later frame than its predecessor, and the last at frame {} "
        "at most",
        count, things, frames, thing, k + 1, keys[k], thing, thing, frames - 1));
  }
  return keys;
}

}  // namespace pipeline
