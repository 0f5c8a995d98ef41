#pragma once

#include <vector>

#include "levelset/library_version.h"

namespace render {

/// Those that render/ takes beside levelset::libraryVersions(), likewise.
[[nodiscard]] std::vector<levelset::LibraryVersion> libraryVersions();

}  // namespace render
