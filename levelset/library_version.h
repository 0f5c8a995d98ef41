#pragma once

#include <string>
#include <vector>

namespace levelset {

/// Name and version of a library that the program links.
struct LibraryVersion {
  std::string name, version;
};

/// Returns the versions of the libraries that levelset/ uses: the version of the loaded library
/// where the library reports one, else the version in its headers.
[[nodiscard]] std::vector<LibraryVersion> libraryVersions();

}  // namespace levelset
