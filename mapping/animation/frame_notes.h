#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace mapping {

/// Collects messages that repeat from frame to frame; reports each for its first frame only.
class FrameNotes {
 public:
  /// Adds "frame N: …" to `messages`, unless a sentence that differs only in its numbers was added
  /// before.
  void add(std::size_t frame, const std::string& sentence, std::vector<std::string>& messages);

 private:
  std::set<std::string> known_;  ///< sentences added so far, with 0 in place of each number
};

}  // namespace mapping
