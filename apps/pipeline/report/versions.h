#pragma once

#include <vector>

#include "levelset/library_version.h"

namespace pipeline {

/// Versions of the program, its libraries and the compiler, in this order.
[[nodiscard]] std::vector<levelset::LibraryVersion> programVersions();

}  // namespace pipeline
