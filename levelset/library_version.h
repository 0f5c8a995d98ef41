#pragma once

#include <string>
#include <vector>

namespace levelset {

/// A library that a module is made of.
struct LibraryVersion {
  std::string name, version;
};

/// Those of levelset/: as they say at run time where they can, else as their headers say.
[[nodiscard]] std::vector<LibraryVersion> libraryVersions();

}  // namespace levelset
