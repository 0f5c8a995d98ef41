#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

/// Reads and writes segmented fields in OpenVDB files. Equal fields give equal bytes, and a field
/// is read back with the same bits.
///
/// All grids hold floats or float vectors, so each is readable as a field by its name:
///
/// | grid | values |
/// |---|---|
/// | `label` | label of the region; active outside the void |
/// | `distance` | distance to the nearest interface, world units; active within the half width |
/// | `neighbour` | label of the region across the nearest interface |
/// | `distance_2`, `neighbour_2`, … | the same for further interfaces, near junctions |
/// | `edge_1` to `edge_7` | with sheets: position of the crossing along an edge, from 0 to 1 |
/// | `point_0` to `point_24` | with sheets: point of a rim or junction, voxels from the grid point
/// |
///
/// Bits 2, 1 and 0 of the number of an edge are its steps along x, y and z. The numbers of points
/// are the slots of simplices in local/kuhn_cell.h.
namespace levelset {

/// Name of the grid that marks a file as a segmented field.
inline constexpr const char* kLabelGrid = "label";

struct WriteSegmentedOptions {
  Progress progress = {};
};

/// Writes a field to a temporary file and renames it over the target.
/// @param path  a file of any name, in the format of OpenVDB
/// @throws InvalidInput for a default-constructed field; IoError; Cancelled
void writeSegmented(const std::filesystem::path& path, const SegmentedField& field,
                    const WriteSegmentedOptions& options = {});

struct ReadSegmentedOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Reads a field that writeSegmented() wrote. A damaged file causes an error, never a hang.
/// @param path  a .vdb file, or "-" for standard input
/// @throws IoError when the file cannot be opened
/// @throws InvalidInput when the file is damaged or holds no segmented field
/// @throws ResourceLimit before the field exceeds options.maxMemory or the machine's memory
[[nodiscard]] SegmentedField readSegmented(const std::filesystem::path& path,
                                           const ReadSegmentedOptions& options = {});

/// Header of a file with a segmented field.
struct SegmentedFileInfo {
  double voxelSize = 0;            ///< world units
  double halfWidth = 0;            ///< voxels
  std::uint64_t activeVoxels = 0;  ///< grid points with a stored distance; 0 if not stated
  /// Box of these grid points, world units; empty if the file does not state it.
  Imath::Box3d worldBounds;
};

/// Reads the headers of the grids only.
/// @throws as readSegmented
[[nodiscard]] SegmentedFileInfo segmentedFileInfo(const std::filesystem::path& path);

/// Returns true if a file holds a segmented field. Reads the headers of its grids only. False for
/// "-", for pipes, and for files that cannot be read.
[[nodiscard]] bool holdsSegmented(const std::filesystem::path& path);

}  // namespace levelset
