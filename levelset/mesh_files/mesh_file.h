#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/progress.h"

/// Reads and writes triangle meshes in PLY, OBJ, STL and OFF files, each also compressed as `.gz`.
/// The extension determines the format, unless it is given. Polygons are split into triangles;
/// elements other than vertices and faces are skipped.
///
/// PLY and OBJ also hold vertex attributes. PLY uses `nx ny nz`, `s t` (also read: `u v`,
/// `texture_u texture_v`) and `red green blue`, with or without `alpha`, as uchar, ushort or float.
/// OBJ uses `vn` and `vt`, and for colours the numbers after the coordinates of `v`. A vertex with
/// several pairs of `vt` and `vn` becomes several vertices: the first keeps its index and the
/// duplicates follow after all vertices of the file. PLY and OBJ keep the seams of attributes, with
/// their duplicate vertices. STL and OFF hold no attributes, so writing them merges the duplicate
/// vertices. Reading a PLY file with `attributes` = false merges them too.
namespace levelset {

struct ReadMeshOptions {
  /// "ply", "obj", "stl", "off", with ".gz" appended if compressed; empty: by extension
  std::string format = {};
  bool attributes = true;  ///< false: reads positions and triangles only
  std::size_t maxMemory = kNoMemoryLimit;
  /// Receives the names of attributes that a TriMesh cannot hold: "colours of faces". Unused when
  /// `attributes` is false.
  std::vector<std::string>* unsupported = nullptr;
  Progress progress = {};
};

/// Reads a mesh.
/// @param path  a file, or "-" for standard input (requires options.format)
/// @throws UsageError for an unknown format
/// @throws IoError when the file cannot be opened or read
/// @throws ResourceLimit when the mesh exceeds options.maxMemory or the machine's memory
/// @throws InvalidInput when the file is empty, truncated or without triangles. Also throws when a
///         count exceeds the file's size, an index is out of range, or a coordinate or attribute is
///         not finite.
[[nodiscard]] TriMesh readMesh(const std::filesystem::path& path,
                               const ReadMeshOptions& options = {});

struct WriteMeshOptions {
  std::string format = {};  ///< as in ReadMeshOptions; STL and PLY are written in binary
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Writes a mesh to a temporary file and renames it over the target (FileTarget).
/// @throws IoError
/// @throws UsageError for an unknown format
/// @throws InvalidInput for attributes whose number differs from that of the vertices, or when
/// single
///         precision is too coarse for an STL file
void writeMesh(const std::filesystem::path& path, const TriMesh& mesh,
               const WriteMeshOptions& options = {});

/// Returns true when a file of that name or format can hold normals, texture coordinates and
/// colours.
[[nodiscard]] bool holdsAttributes(const std::filesystem::path& nameOrFormat);

/// Returns true for a file name or format that readMesh supports.
[[nodiscard]] bool isMeshFormat(const std::filesystem::path& nameOrFormat);

/// Properties of a mesh file from its header, without reading its elements where the format allows.
struct MeshFileInfo {
  std::string format;        ///< e.g. "ply, binary little endian"
  std::size_t vertices = 0;  ///< 0 when only a full read can determine it
  std::size_t faces = 0;
  std::string attributes = {};  ///< attributes in words, from describe(); empty: none or unknown
};
/// Reads the header of a mesh file. Refuses counts that the file is too small to hold, as readMesh
/// does.
/// @param format  as in ReadMeshOptions
[[nodiscard]] MeshFileInfo meshFileInfo(const std::filesystem::path& path,
                                        const std::string& format = {});

}  // namespace levelset
