#pragma once

#include <vector>

#include "levelset/library_version.h"

namespace render {

/// Versions of the libraries that render/ uses in addition to levelset::libraryVersions(), in the
/// same form.
[[nodiscard]] std::vector<levelset::LibraryVersion> libraryVersions();

}  // namespace render
