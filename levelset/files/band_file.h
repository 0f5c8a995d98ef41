#pragma once

#include <Imath/ImathBox.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "levelset/fields/grid.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Reads and writes narrow bands and fields in OpenVDB files (`.vdb`), and writes bands to NanoVDB
/// files (`.nvdb`).
namespace levelset {

struct ReadBandOptions {
  std::string grid = {};  ///< name of the grid; empty: the only float level set of the file
  std::size_t maxMemory = kNoMemoryLimit;
  /// Only blocks that intersect this box are read, world units. Other parts of the band are
  /// missing, and their signs are undefined.
  Imath::Box3d region = kEverywhere;
  BandRepairs* repairs = nullptr;  ///< receives the numbers of repaired values; may be null
  Progress progress = {};
};

/// Reads a level set as a band. Values stored as half floats or doubles become floats. A damaged
/// file causes an error, never a hang.
/// @param path  a .vdb file, or "-" for standard input
/// @throws UsageError for a .nvdb file
/// @throws IoError when the file cannot be opened
/// @throws InvalidInput when the file is damaged or lacks the requested grid, or the grid breaks
///         the invariants of a band
/// @throws ResourceLimit before the grid exceeds options.maxMemory or the machine's memory
[[nodiscard]] NarrowBand readBand(const std::filesystem::path& path,
                                  const ReadBandOptions& options = {});

/// Reads a grid of any class as a field of numbers or vectors. options.grid must name the grid,
/// unless it is the only level set of the file.
/// @throws as readBand; also InvalidInput for NaN or infinite values
[[nodiscard]] FieldGrid readField(const std::filesystem::path& path,
                                  const ReadBandOptions& options = {});

/// Calls visit with the centre of each block of 8³ grid points of a level set, world units. Reads
/// no values, so memory holds only the upper nodes of the tree.
/// @param options  `region` is ignored
/// @throws as readBand
void visitBlocks(const std::filesystem::path& path, const ReadBandOptions& options,
                 const std::function<void(const Imath::V3d&)>& visit);

/// Result of readGrid: a level set as a band, any other grid as a field.
using BandOrField = std::variant<NarrowBand, FieldGrid>;
[[nodiscard]] BandOrField readGrid(const std::filesystem::path& path,
                                   const ReadBandOptions& options = {});

struct WriteBandOptions {
  std::string name = "surface";  ///< name of the grid
  std::string format = {};       ///< "vdb" or "nvdb"; empty: by extension
  Progress progress = {};
};

/// Writes a band to a temporary file and renames it over the target (FileTarget). Equal bands give
/// equal bytes: the content hash replaces OpenVDB's random identifier.
/// @throws IoError
/// @throws UsageError for an unknown format
/// @throws InvalidInput for a default-constructed band, an open surface, or voxels too small for a
///         NanoVDB file
void writeBand(const std::filesystem::path& path, const NarrowBand& band,
               const WriteBandOptions& options = {});

/// Writes a field as writeBand does, to `.vdb` only. Keeps the grid class.
void writeField(const std::filesystem::path& path, const FieldGrid& field,
                const WriteBandOptions& options = {});

/// Properties of one grid of a .vdb file, from its header and metadata only. No voxel is loaded.
struct GridInfo {
  std::string name;
  std::string type;  ///< value type: "float", "half", "double", "vec3s", …; else OpenVDB's name
  std::string gridClass;           ///< "level set", "fog volume", …
  bool isLevelSet = false;         ///< level set of numbers, which readBand accepts
  std::uint64_t activeVoxels = 0;  ///< 0 when the file does not state it
  double voxelSize = 0;            ///< world units; 0 when the voxels are not cubes of equal size
  double halfWidth = 0;  ///< half width of a level set, voxels; else 0, and 0 if voxelSize is 0
  /// Box of the active voxels, index space. Empty when the file does not state it or the grid has
  /// no active voxel.
  Imath::Box3d indexBounds;
  /// Box of the centres of the active voxels, world units. Empty when `indexBounds` is empty, or
  /// when the grid has a frustum transform.
  Imath::Box3d worldBounds;
  std::uint64_t bytes = 0;  ///< memory of the tree in bytes; 0 when the file does not state it
};
[[nodiscard]] std::vector<GridInfo> bandFileInfo(const std::filesystem::path& path);

[[nodiscard]] bool isBandFormat(const std::filesystem::path& nameOrFormat);
/// Returns true for the name of a `.vdb` file, and for "vdb".
[[nodiscard]] bool isVdbFormat(const std::filesystem::path& nameOrFormat);

}  // namespace levelset
