#pragma once

#include <string>

#include "levelset/mesh.h"

namespace pipeline {

/// A mesh bit for bit, with a checksum, for this machine and this program.
[[nodiscard]] std::string bytesOf(const levelset::TriMesh& mesh);
/// @return false for what is no such bytes, or damaged: the mesh is not whole then
[[nodiscard]] bool readMeshBytes(const std::string& bytes, levelset::TriMesh& mesh);

}  // namespace pipeline
