#pragma once

// Internal header of levelset/point_files: shared code of the readers and writers.

#include <string>
#include <string_view>

#include "levelset/files/byte_io.h"
#include "levelset/mesh_files/mesh_parts.h"
#include "levelset/point_files/point_file.h"

namespace levelset::point_files {

/// Collects the points of a file and checks them.
class CloudBuilder {
 public:
  CloudBuilder(std::string name, const ReadPointsOptions& options, std::string_view input)
      : name_(std::move(name)), options_(options), input_(input) {}

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] bool wantsAttributes() const { return options_.attributes; }
  /// Name of the grid to read; empty: the only one.
  [[nodiscard]] const std::string& grid() const { return options_.grid; }
  [[nodiscard]] PointCloud& cloud() { return cloud_; }
  [[nodiscard]] const PointCloud& cloud() const { return cloud_; }
  /// Reserves memory for the points that a header promises. The caller has checked their number
  /// against the size of the file.
  /// @param attributes  one entry in each list that the points will fill
  void reserve(std::size_t points, const PointCloud& attributes);
  /// @throws ResourceLimit when `bytes` more bytes would exceed the memory limit
  void requireMore(double bytes) const;
  /// Declares the precision of the coordinates. If it is not called, the precision is Float when
  /// every coordinate is exactly a float, else Double.
  void declarePrecision(CoordinatePrecision precision);
  /// Reports a remark about the file, once.
  void note(const std::string& text);

  // Each function adds an entry to one list. `place` is its position in the file for messages.
  // All throw InvalidInput for numbers that are not finite or outside their range.
  /// @param at  reading position, for the progress
  void addPosition(const Imath::V3d& position, FilePosition place, const char* at);
  void addNormal(const Imath::V3d& normal, FilePosition place);
  void addColor(const Imath::V4f& color, FilePosition place);
  void addRadius(double radius, FilePosition place);
  void addWeight(double weight, FilePosition place);

  /// Completes the cloud. @throws InvalidInput without any point
  [[nodiscard]] PointCloud finish();

 private:
  PointCloud cloud_;
  std::string name_;
  const ReadPointsOptions& options_;
  std::string_view input_;
  bool precisionDeclared_ = false, allFloat_ = true;
};

void readPlyPoints(std::string_view input, CloudBuilder& builder);
void readObjPoints(std::string_view input, CloudBuilder& builder);
void readXyzPoints(std::string_view input, CloudBuilder& builder);
void readPtsPoints(std::string_view input, CloudBuilder& builder);
/// Reads a grid of points. Points come in the order of the grid.
void readVdbPoints(std::string_view input, CloudBuilder& builder);

void writePlyPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress);
void writeObjPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress);
void writeXyzPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress);
void writeCsvPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress);
void writePtsPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress);

/// Writes the points as one grid. @param name  name of the grid
void writeVdbPoints(const std::filesystem::path& path, const PointCloud& cloud,
                    const std::string& name, const Progress& progress);
/// Returns true if the grid of that name holds points. Without a name: if the file has points, and
/// no level set.
/// @throws InvalidInput
[[nodiscard]] bool vdbHoldsPoints(std::string_view input, const std::string& grid,
                                  const std::string& name);

/// Reads the properties of a file of points from its first bytes.
/// @param fileSize  size of the complete file; 0: unknown
[[nodiscard]] PointFileInfo plyPointInfo(std::string_view head, std::size_t fileSize,
                                         const std::string& name);
[[nodiscard]] PointFileInfo xyzPointInfo(std::string_view head, const std::string& name);
[[nodiscard]] PointFileInfo ptsPointInfo(std::string_view head, const std::string& name);

/// Returns true for a PLY header with vertices and without faces.
[[nodiscard]] bool plyLacksFaces(std::string_view head, const std::string& name);
/// Returns true for an OBJ text with vertices and without faces.
[[nodiscard]] bool objLacksFaces(std::string_view input);

/// Returns true when every colour is n / 255 rounded to float, as a file with bytes has it.
[[nodiscard]] bool hasByteColors(const PointCloud& cloud);
/// Returns true when an alpha differs from 1.
[[nodiscard]] bool hasAlpha(const PointCloud& cloud);
/// Checks a part of a colour in a text: an integer from 0 to 255, or a fraction.
/// @throws InvalidInput
void requireColorPart(const std::string& name, FilePosition place, double part);
/// Returns the byte of a part of a colour.
[[nodiscard]] unsigned char colorByte(float part);

}  // namespace levelset::point_files
