#pragma once

#include <string>
#include <vector>

namespace levelset {

/// Name and version of a library that the program links.
struct LibraryVersion {
  std::string name, version;
};

/// Versions of the libraries that levelset/ uses: the run-time version where the library reports
/// one, else the version in its headers.
[[nodiscard]] std::vector<LibraryVersion> libraryVersions();

}  // namespace levelset
