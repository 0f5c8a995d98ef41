#pragma once

#include <string>

#include "levelset/mesh.h"
#include "levelset/points/point_cloud.h"

namespace pipeline {

/// Encodes a mesh bit for bit, with a checksum. Only the same program on the same machine type can
/// read it.
[[nodiscard]] std::string bytesOf(const levelset::TriMesh& mesh);
/// Decodes the bytes of bytesOf().
/// @return false if the bytes are damaged or have another format; `mesh` is then unchanged or
/// incomplete
[[nodiscard]] bool readMeshBytes(const std::string& bytes, levelset::TriMesh& mesh);

/// Encodes a point cloud bit for bit, as bytesOf(mesh) does.
[[nodiscard]] std::string bytesOf(const levelset::PointCloud& cloud);
/// Decodes the bytes of bytesOf(cloud), as readMeshBytes() does.
[[nodiscard]] bool readCloudBytes(const std::string& bytes, levelset::PointCloud& cloud);

}  // namespace pipeline
