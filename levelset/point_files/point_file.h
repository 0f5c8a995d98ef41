#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "levelset/points/point_cloud.h"
#include "levelset/progress.h"

/// Reads and writes point clouds: PLY, OBJ, XYZ, CSV and PTS, each also compressed as `.gz`, and
/// grids of points in OpenVDB files (`.vdb`). The extension determines the format, unless it is
/// given.
///
/// PLY: `x y z`, and if present `nx ny nz`, `red green blue` with or without `alpha`, `radius`, and
/// `confidence` or `weight`. OBJ: `v`, colours behind the coordinates, and one `vn` for each `v`.
/// XYZ and CSV: one point on a line, separated by blanks, commas or semicolons. Decimal commas are
/// refused. A line with the number of points may precede them. The columns follow from a header
/// line of names, also behind `#` or `//`. Without it their number decides:
///   3: x y z
///   4: x y z, and a number that is not kept (intensity)
///   6: x y z and a normal; a colour if all numbers are integers from 0 to 255, and one exceeds 1
///   7: x y z, a number that is not kept, and a colour
///   9: x y z, a normal and a colour
/// PTS: a line with the number of points, then x y z, and if present intensity and colour. Six
/// columns are a colour. Several such blocks may follow each other. Colours in text and OBJ are
/// integers from 0 to 255, or fractions if none exceeds 1.
///
/// VDB: attributes `P`, `N`, `Cd`, `Alpha`, `pscale` (radius) and `weight`. When read, `radius` and
/// `confidence` are known, too. Positions are stored relative to voxels, of type float,
/// uncompressed. They come back with an error of at most 2⁻²⁶ voxel, and exactly where they are of
/// type float and above 2⁻¹²⁶ voxel. The voxels have about eight points. Points come back in the
/// order of the grid.
namespace levelset {

struct ReadPointsOptions {
  /// "ply", "obj", "xyz", "csv" or "pts", with ".gz" appended if compressed, or "vdb"; empty: by
  /// extension
  std::string format = {};
  std::string grid = {};   ///< name of the grid in a .vdb file; empty: the only one of points
  bool attributes = true;  ///< false: reads positions only
  std::size_t maxMemory = kNoMemoryLimit;
  std::vector<std::string>* notes = nullptr;  ///< receives remarks about the file; may be null
  Progress progress = {};
};

/// Reads a point cloud. The faces of a mesh file are skipped.
/// @param path  a file, or "-" for standard input (requires options.format)
/// @throws UsageError for an unknown format
/// @throws IoError when the file cannot be opened or read
/// @throws ResourceLimit when the points exceed options.maxMemory or the machine's memory
/// @throws InvalidInput when the file is empty, truncated, without points or damaged, or when a
///         number is not finite or outside the range of its attribute
[[nodiscard]] PointCloud readPoints(const std::filesystem::path& path,
                                    const ReadPointsOptions& options = {});

struct WritePointsOptions {
  std::string format = {};      ///< as in ReadPointsOptions; PLY is written in binary
  std::string name = "points";  ///< name of the grid in a .vdb file
  Progress progress = {};
};

/// Writes a point cloud to a temporary file and renames it over the target (FileTarget).
/// @throws IoError
/// @throws UsageError for an unknown format
/// @throws InvalidInput for a cloud without points, or with lists of unequal length
void writePoints(const std::filesystem::path& path, const PointCloud& cloud,
                 const WritePointsOptions& options = {});

/// Returns the names of the attributes of the cloud that a file of that name or format cannot hold,
/// as describe() does.
[[nodiscard]] std::string unwritableAttributes(const std::filesystem::path& nameOrFormat,
                                               const PointCloud& cloud);

/// Returns true for a file name or format that holds points and no faces: xyz, csv and pts.
[[nodiscard]] bool isPointFormat(const std::filesystem::path& nameOrFormat);
/// Returns true for a file name or format that writePoints supports.
[[nodiscard]] bool holdsPoints(const std::filesystem::path& nameOrFormat);

/// Returns true for a PLY or OBJ file with vertices and without faces. Such a file is a point
/// cloud. Returns false for other formats, and when the file cannot be read.
/// @param format  as in ReadPointsOptions
[[nodiscard]] bool lacksFaces(const std::filesystem::path& path, const std::string& format = {});

/// Returns true if readPoints() is to read a .vdb file: if the grid of that name holds points;
/// without a name, if the file has grids of points and no level set. Returns false for other
/// formats, and when the file cannot be read.
[[nodiscard]] bool holdsPointGrid(const std::filesystem::path& path, const std::string& grid = {},
                                  const std::string& format = {});

/// Properties of a file of points, from its header.
struct PointFileInfo {
  std::string format;           ///< e.g. "ply, binary little endian"
  std::size_t points = 0;       ///< 0 when only a full read can determine it
  std::string attributes = {};  ///< attributes in words; empty: none or unknown
};
/// Reads the header of a file of points.
/// @throws as readPoints
[[nodiscard]] PointFileInfo pointFileInfo(const std::filesystem::path& path,
                                          const std::string& format = {});

}  // namespace levelset
