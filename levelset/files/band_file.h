#pragma once

#include <Imath/ImathBox.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include "levelset/fields/grid.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Narrow bands and fields in OpenVDB (`.vdb`) files, and bands in NanoVDB (`.nvdb`) files.
namespace levelset {

struct ReadBandOptions {
  std::string grid = {};  ///< name of the grid; empty: the only float level set of the file
  std::size_t maxMemory = kNoMemoryLimit;
  BandRepairs* repairs = nullptr;  ///< told what the grid lacked to be a band
  Progress progress = {};
};

/// Values stored as half floats or doubles become floats.
/// @param path  a .vdb file, or "-" for standard input
/// @throws IoError when it cannot be opened; InvalidInput when it is damaged, holds no such grid,
/// or
///         the grid breaks the invariants of a band. Damaged files end in an error, never in a
///         hang. ResourceLimit before the grid passes options.maxMemory or the machine's memory
[[nodiscard]] NarrowBand readBand(const std::filesystem::path& path,
                                  const ReadBandOptions& options = {});

/// The same for a grid of any class: numbers or vectors. The grid must be named unless it is a
/// level set and the only one.
/// @throws also InvalidInput for NaN or infinite values
[[nodiscard]] FieldGrid readField(const std::filesystem::path& path,
                                  const ReadBandOptions& options = {});

/// A level set as a band, any other grid as a field.
using BandOrField = std::variant<NarrowBand, FieldGrid>;
[[nodiscard]] BandOrField readGrid(const std::filesystem::path& path,
                                   const ReadBandOptions& options = {});

struct WriteBandOptions {
  std::string name = "surface";  ///< of the grid
  std::string format = {};       ///< "vdb" or "nvdb"; empty: by extension
  Progress progress = {};
};

/// Writes beside the target and renames (FileTarget). Equal bands give equal bytes: the identifier
/// that OpenVDB draws at random is replaced by the content hash.
/// @throws IoError; UsageError for an unknown format; InvalidInput for a band that was never made
void writeBand(const std::filesystem::path& path, const NarrowBand& band,
               const WriteBandOptions& options = {});

/// As writeBand, to `.vdb` only; its class is kept.
void writeField(const std::filesystem::path& path, const FieldGrid& field,
                const WriteBandOptions& options = {});

/// One grid of a .vdb file, from its header and metadata alone: no voxel is loaded.
struct GridInfo {
  std::string name;
  std::string type;  ///< of the values: "float", "half", "double", "vec3s", …; else OpenVDB's word
  std::string gridClass;           ///< "level set", "fog volume", …
  bool isLevelSet = false;         ///< of that class, and of numbers: readBand takes it
  std::uint64_t activeVoxels = 0;  ///< 0 when the file does not say
  double voxelSize = 0;            ///< 0 when the voxels are no cubes of one size
  double halfWidth = 0;            ///< voxels, of a level set; else 0
  Imath::Box3d indexBounds;        ///< empty when the file does not say
  Imath::Box3d worldBounds;        ///< of the centres of its active voxels; empty likewise
  std::uint64_t bytes = 0;         ///< of memory that its tree takes; 0 when the file does not say
};
[[nodiscard]] std::vector<GridInfo> bandFileInfo(const std::filesystem::path& path);

[[nodiscard]] bool isBandFormat(const std::filesystem::path& nameOrFormat);

}  // namespace levelset
