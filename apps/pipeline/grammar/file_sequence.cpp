#include "apps/pipeline/grammar/file_sequence.h"

#include <fmt/core.h>

#include <algorithm>

namespace pipeline {

std::size_t FileSequence::numberPosition() const {
  const std::size_t name = pattern_.find_last_of('/');
  return pattern_.find('#', name == std::string::npos ? 0 : name);
}

std::filesystem::path FileSequence::file(std::size_t number) const {
  const std::size_t first = numberPosition();
  const std::size_t last = std::min(pattern_.find_first_not_of('#', first), pattern_.size());
  return pattern_.substr(0, first) + fmt::format("{:0{}}", number, last - first) +
         pattern_.substr(last);
}

}  // namespace pipeline
