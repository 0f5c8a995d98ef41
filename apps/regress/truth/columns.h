#pragma once

#include <string>
#include <vector>

namespace regress {

/// Figures that rows may have. Their names are the columns of results.csv.
struct Column {
  const char* name;
  const char* heading;  ///< for people
  const char* meaning;
};
[[nodiscard]] const std::vector<Column>& columns();

}  // namespace regress
