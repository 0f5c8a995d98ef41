#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/progress.h"

/// Triangle meshes in files: PLY, OBJ, STL and OFF, each also compressed as `.gz`. The format is
/// told by the extension, or given. Polygons are split into triangles; unused elements are skipped.
/// PLY and OBJ hold the attributes of vertices too. In PLY they are `nx ny nz`, `s t` (also read:
/// `u v`, `texture_u texture_v`) and `red green blue` with or without `alpha`, of uchar, ushort or
/// float. In OBJ they are `vn`, `vt` and numbers behind the coordinates of `v`; a vertex with
/// several pairs of `vt` and `vn` becomes as many vertices, the first in its place and the others
/// behind all. Seams are written as they are held, by vertices of their own. STL and OFF hold none;
/// they are written with the seams closed, and a PLY whose attributes are not wanted is read so.
namespace levelset {

struct ReadMeshOptions {
  std::string format =
      {};  ///< "ply", "obj", "stl", "off", with ".gz" behind if compressed; empty: by extension
  bool attributes = true;  ///< false: positions and triangles only, whatever else is there
  std::size_t maxMemory = kNoMemoryLimit;
  /// Told what the mesh had that it cannot carry, in words: "colours of faces"; not for meshes
  /// whose attributes are not wanted.
  std::vector<std::string>* leftAside = nullptr;
  Progress progress = {};
};

/// @param path  a file, or "-" for standard input (needs options.format)
/// @throws IoError when it cannot be opened or read; InvalidInput when it is not what it claims:
///         empty, truncated, counts beyond the file's size, index out of range, NaN or infinite
///         coordinate, no triangle; attributes that are no numbers, or an index of one out of range
[[nodiscard]] TriMesh readMesh(const std::filesystem::path& path,
                               const ReadMeshOptions& options = {});

struct WriteMeshOptions {
  std::string format = {};  ///< as in ReadMeshOptions; STL and PLY are written binary
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Writes beside the target and renames (FileTarget).
/// @throws IoError; UsageError for an unknown format; InvalidInput for attributes that do not fit
///         the vertices
void writeMesh(const std::filesystem::path& path, const TriMesh& mesh,
               const WriteMeshOptions& options = {});

/// Does a file of that name, or format, hold normals, texture coordinates and colours?
[[nodiscard]] bool holdsAttributes(const std::filesystem::path& nameOrFormat);

/// True for a name, or a format, that readMesh understands.
[[nodiscard]] bool isMeshFormat(const std::filesystem::path& nameOrFormat);

/// What the header of a mesh file says, without reading its elements where the format allows.
struct MeshFileInfo {
  std::string format;        ///< e.g. "ply, binary little endian"
  std::size_t vertices = 0;  ///< 0 when only a full read would tell
  std::size_t faces = 0;
  std::string attributes = {};  ///< in words, as describe() has them; empty: none, or not known
};
/// Counts are compared with the size of the file: what it cannot hold is refused as readMesh does.
/// @param format  as in ReadMeshOptions
[[nodiscard]] MeshFileInfo meshFileInfo(const std::filesystem::path& path,
                                        const std::string& format = {});

}  // namespace levelset
