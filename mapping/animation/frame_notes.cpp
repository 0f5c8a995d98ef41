#include "mapping/animation/frame_notes.h"

#include <fmt/core.h>

namespace mapping {

void FrameNotes::add(std::size_t frame, const std::string& sentence,
                     std::vector<std::string>& messages) {
  std::string kind;
  for (std::size_t i = 0; i < sentence.size();) {
    if (sentence[i] < '0' || sentence[i] > '9') {
      kind += sentence[i++];
      continue;
    }
    i = sentence.find_first_not_of("0123456789.e+-", i);
    if (i == std::string::npos) i = sentence.size();
    kind += '0';
  }
  if (known_.insert(std::move(kind)).second)
    messages.push_back(fmt::format("frame {}: {}", frame, sentence));
}

}  // namespace mapping
