#pragma once

#include <string>
#include <vector>

namespace regress {

/// Figure that a row can have. It is a column of results.csv and of the tables in index.html.
struct Column {
  const char* name;
  const char* heading;  ///< heading in the tables of index.html
  const char* meaning;
};
[[nodiscard]] const std::vector<Column>& columns();

}  // namespace regress
