#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "levelset/mesh.h"
#include "levelset/progress.h"

/// Triangle meshes in files: PLY, OBJ, STL and OFF, each also compressed as `.gz`. The format is
/// told by the extension, or given. Polygons are split into triangles; unused elements are skipped.
namespace levelset {

struct ReadMeshOptions {
  std::string format =
      {};  ///< "ply", "obj", "stl", "off", with ".gz" behind if compressed; empty: by extension
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// @param path  a file, or "-" for standard input (needs options.format)
/// @throws IoError when it cannot be opened or read; InvalidInput when it is not what it claims:
///         empty, truncated, counts beyond the file's size, index out of range, NaN or infinite
///         coordinate, no triangle
[[nodiscard]] TriMesh readMesh(const std::filesystem::path& path,
                               const ReadMeshOptions& options = {});

struct WriteMeshOptions {
  std::string format = {};  ///< as in ReadMeshOptions; STL and PLY are written binary
  Progress progress = {};
};

/// Writes beside the target and renames (FileTarget).
/// @throws IoError; UsageError for an unknown format
void writeMesh(const std::filesystem::path& path, const TriMesh& mesh,
               const WriteMeshOptions& options = {});

/// True for a name, or a format, that readMesh understands.
[[nodiscard]] bool isMeshFormat(const std::filesystem::path& nameOrFormat);

/// What the header of a mesh file says, without reading its elements where the format allows.
struct MeshFileInfo {
  std::string format;        ///< e.g. "ply, binary little endian"
  std::size_t vertices = 0;  ///< 0 when only a full read would tell
  std::size_t faces = 0;
};
/// Counts are compared with the size of the file: what it cannot hold is refused as readMesh does.
/// @param format  as in ReadMeshOptions
[[nodiscard]] MeshFileInfo meshFileInfo(const std::filesystem::path& path,
                                        const std::string& format = {});

}  // namespace levelset
