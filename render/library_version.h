#pragma once

#include <vector>

#include "levelset/library_version.h"

namespace render {

/// Names and versions of the libraries that render/ uses in addition to those of
/// levelset::libraryVersions().
[[nodiscard]] std::vector<levelset::LibraryVersion> libraryVersions();

}  // namespace render
