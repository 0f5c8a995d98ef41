#pragma once

#include <vector>

#include "levelset/library_version.h"

namespace pipeline {

/// What this program is made of: itself first, its libraries, and the compiler at the end.
[[nodiscard]] std::vector<levelset::LibraryVersion> programVersions();

}  // namespace pipeline
