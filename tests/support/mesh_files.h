#pragma once

#include <string>

#include "levelset/mesh_files/mesh_file.h"
#include "tests/support/files.h"

namespace support {

/// Reads `text` as a file of that name with readMesh.
inline levelset::TriMesh parse(const std::string& name, const std::string& text,
                               const levelset::ReadMeshOptions& options = {}) {
  const TemporaryFolder folder;
  writeText(folder / name, text);
  return levelset::readMesh(folder / name, options);
}

}  // namespace support
