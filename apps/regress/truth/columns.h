#pragma once

#include <string>
#include <vector>

namespace regress {

/// Figure that a row can have. The names are the columns of results.csv.
struct Column {
  const char* name;
  const char* heading;  ///< heading of the page
  const char* meaning;
};
[[nodiscard]] const std::vector<Column>& columns();

}  // namespace regress
