#pragma once

#include <algorithm>
#include <cstring>
#include <string>

#include "levelset/error.h"
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

/// Message of the InvalidInput with which readMesh refuses `text`.
inline std::string refused(const std::string& name, const std::string& text) {
  return refusal<levelset::InvalidInput>([&] { static_cast<void>(parse(name, text)); });
}

/// A tetrahedron with coordinates that need the given precision.
inline levelset::TriMesh tetrahedron(
    levelset::CoordinatePrecision precision = levelset::CoordinatePrecision::Float) {
  levelset::TriMesh mesh;
  const double third =
      precision == levelset::CoordinatePrecision::Float ? static_cast<double>(1.f / 3) : 1.0 / 3;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, third, -2.25}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  mesh.precision = precision;
  return mesh;
}

/// Appends the bytes of a number.
template <typename T>
void append(std::string& bytes, T value, bool bigEndian) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  if (bigEndian) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

inline const std::string kAsciiPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

}  // namespace support
