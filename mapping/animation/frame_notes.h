#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace mapping {

/// Sentences that come up frame by frame, each told of the first frame that says it.
class FrameNotes {
 public:
  /// Adds "frame N: …" to `told`, unless a sentence that differs in its figures only was added
  /// before.
  void add(std::size_t frame, const std::string& sentence, std::vector<std::string>& told);

 private:
  std::set<std::string> known_;  ///< without their figures
};

}  // namespace mapping
