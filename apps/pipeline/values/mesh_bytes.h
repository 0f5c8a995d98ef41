#pragma once

#include <string>

#include "levelset/mesh.h"

namespace pipeline {

/// Encodes a mesh bit for bit, with a checksum. Only the same program on the same machine type can
/// read it.
[[nodiscard]] std::string bytesOf(const levelset::TriMesh& mesh);
/// Decodes the bytes of bytesOf().
/// @return false if the bytes are damaged or have another format; `mesh` is then unchanged or
/// incomplete
[[nodiscard]] bool readMeshBytes(const std::string& bytes, levelset::TriMesh& mesh);

}  // namespace pipeline
