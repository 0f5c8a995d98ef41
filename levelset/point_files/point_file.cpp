#include "levelset/point_files/point_file.h"

#include <fmt/core.h>

#include <new>
#include <optional>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/point_files/cloud_builder.h"

namespace levelset {
namespace {

namespace fs = std::filesystem;
using point_files::CloudBuilder;

struct PointFormat {
  const char* extension;
  void (*read)(std::string_view, CloudBuilder&);
  void (*write)(ByteWriter&, const PointCloud&, const Progress&);  ///< null: writeVdbPoints()
  bool isOnlyPoints;  ///< false: the format also holds meshes
  bool hasNormals, hasColors, hasMore;
};

constexpr PointFormat kPointFormats[] = {
    {"ply", point_files::readPlyPoints, point_files::writePlyPoints, false, true, true, true},
    {"obj", point_files::readObjPoints, point_files::writeObjPoints, false, true, true, false},
    {"xyz", point_files::readXyzPoints, point_files::writeXyzPoints, true, true, true, false},
    {"csv", point_files::readXyzPoints, point_files::writeCsvPoints, true, true, true, true},
    {"pts", point_files::readPtsPoints, point_files::writePtsPoints, true, false, true, false},
    {"vdb", point_files::readVdbPoints, nullptr, false, true, true, true}};

struct PointFormatChoice {
  const PointFormat* format;
  bool isCompressed;
};

std::optional<PointFormatChoice> findPointFormat(const fs::path& nameOrFormat) {
  std::string text = nameOrFormat.filename().string();
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c | 0x20);
  const bool isCompressed = text.ends_with(".gz");
  if (isCompressed) text.resize(text.size() - 3);
  const std::string extension = text.substr(text.rfind('.') + 1);
  for (const PointFormat& format : kPointFormats)
    if (extension == format.extension) return PointFormatChoice{&format, isCompressed};
  return std::nullopt;
}

PointFormatChoice pointFormat(const fs::path& path, const std::string& given) {
  const fs::path name = given.empty() ? path : fs::path(given);
  if (const auto choice = findPointFormat(name)) return *choice;
  throw UsageError(fmt::format(
      "'{}' names no format of points; use ply, obj, xyz, csv or pts, with .gz appended "
      "if compressed, or vdb",
      name.string()));
}

constexpr std::size_t kPointInfoBytes = 1 << 20;

}  // namespace

PointCloud readPoints(const fs::path& path, const ReadPointsOptions& options) {
  const PointFormatChoice choice = pointFormat(path, options.format);
  report(options.progress, 0);
  try {
    const Bytes bytes = readBytes(path, options.maxMemory);
    CloudBuilder builder(inputName(path), options, bytes.view());
    choice.format->read(bytes.view(), builder);
    PointCloud cloud = builder.finish();
    report(options.progress, 1);
    return cloud;
  } catch (const std::bad_alloc&) {
    throw ResourceLimit(fmt::format("{} does not fit into memory; use fewer points or free memory",
                                    inputName(path)));
  }
}

void writePoints(const fs::path& path, const PointCloud& cloud, const WritePointsOptions& options) {
  const PointFormatChoice choice = pointFormat(path, options.format);
  requirePoints(cloud);
  if (cloud.isEmpty())
    throw InvalidInput(
        "the point cloud has no points, and a file needs one; check the actions "
        "before it");
  if (!choice.format->write) {
    if (choice.isCompressed)
      throw UsageError("a .vdb file is compressed already; write it without .gz");
    return point_files::writeVdbPoints(path, cloud, options.name, options.progress);
  }
  report(options.progress, 0);
  ByteWriter out(path, choice.isCompressed);
  choice.format->write(out, cloud, options.progress);
  out.commit();
  report(options.progress, 1);
}

std::string unwritableAttributes(const fs::path& nameOrFormat, const PointCloud& cloud) {
  const auto choice = findPointFormat(nameOrFormat);
  if (!choice) return describe(cloud);
  PointCloud lost;
  if (!choice->format->hasNormals && !cloud.normals.empty()) lost.normals.resize(1);
  if (!choice->format->hasColors && !cloud.colors.empty()) lost.colors.resize(1);
  if (!choice->format->hasMore && !cloud.radii.empty()) lost.radii.resize(1);
  if (!choice->format->hasMore && !cloud.weights.empty()) lost.weights.resize(1);
  return describe(lost);
}

bool isPointFormat(const fs::path& nameOrFormat) {
  const auto choice = findPointFormat(nameOrFormat);
  return choice && choice->format->isOnlyPoints;
}

bool holdsPoints(const fs::path& nameOrFormat) {
  return findPointFormat(nameOrFormat).has_value();
}

bool lacksFaces(const fs::path& path, const std::string& format) {
  const auto choice = findPointFormat(format.empty() ? path : fs::path(format));
  if (!choice || choice->format->isOnlyPoints || !choice->format->write || path == "-")
    return false;
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;  // a pipe can be read only once
  try {
    if (choice->format->read == point_files::readPlyPoints)
      return point_files::plyLacksFaces(readFirstBytes(path, kPointInfoBytes).bytes.view(),
                                        inputName(path));
    return point_files::objLacksFaces(MappedFile(path).view());
  } catch (const Error&) {  // reading the file reports the error
    return false;
  }
}

bool holdsPointGrid(const fs::path& path, const std::string& grid, const std::string& format) {
  const auto choice = findPointFormat(format.empty() ? path : fs::path(format));
  if (!choice || choice->format->write || path == "-") return false;
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;  // a pipe can be read only once
  try {
    return point_files::vdbHoldsPoints(MappedFile(path).view(), grid, inputName(path));
  } catch (const Error&) {  // reading the file reports the error
    return false;
  }
}

PointFileInfo pointFileInfo(const fs::path& path, const std::string& format) {
  const PointFormatChoice choice = pointFormat(path, format);
  const std::string name = inputName(path);
  const FirstBytes first = readFirstBytes(path, kPointInfoBytes);
  const std::string_view head = first.bytes.view();
  if (head.empty()) failFile(name, "is empty; download or create the file again");
  PointFileInfo info;
  if (choice.format->read == point_files::readPlyPoints)
    info = point_files::plyPointInfo(head, first.fileSize, name);
  else if (choice.format->read == point_files::readPtsPoints)
    info = point_files::ptsPointInfo(head, name);
  else if (choice.format->read == point_files::readXyzPoints)
    info = point_files::xyzPointInfo(head, name);
  else
    info.format = choice.format->extension;
  if (choice.isCompressed) info.format += ", compressed";
  return info;
}

}  // namespace levelset
