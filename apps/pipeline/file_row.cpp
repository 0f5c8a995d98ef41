#include "apps/pipeline/file_row.h"

#include <fmt/core.h>

namespace pipeline {

std::filesystem::path FileRow::file(std::size_t number) const {
  const std::size_t first = pattern_.find('#');
  const std::size_t last = pattern_.find_first_not_of('#', first);
  const std::size_t digits = (last == std::string::npos ? pattern_.size() : last) - first;
  return pattern_.substr(0, first) + fmt::format("{:0{}}", number, digits) +
         pattern_.substr(first + digits);
}

}  // namespace pipeline
