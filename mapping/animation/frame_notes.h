#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace mapping {

/// Messages that repeat frame by frame, each reported for the first frame only.
class FrameNotes {
 public:
  /// Adds "frame N: …" to `messages`, unless a sentence that differs only in its numbers was added
  /// before.
  void add(std::size_t frame, const std::string& sentence, std::vector<std::string>& messages);

 private:
  std::set<std::string> known_;  ///< sentences without their numbers
};

}  // namespace mapping
