#include "levelset/volume_files/volume_file.h"

#include <fmt/core.h>

#include <algorithm>

#include "levelset/error.h"
#include "levelset/files/byte_io.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset {
namespace {

using volume_files::Encoding;
using volume_files::VolumeHeader;
namespace fs = std::filesystem;

/// Extension of a file or format in lower case, without the dot and without .gz.
std::string volumeExtension(const fs::path& nameOrFormat) {
  std::string name = volume_files::lowered(nameOrFormat.filename().string());
  if (name.ends_with(".gz")) name.resize(name.size() - 3);
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? name : name.substr(dot + 1);
}

bool isGzipped(const fs::path& name) {
  return volume_files::lowered(name.string()).ends_with(".gz");
}

VolumeHeader rawHeader(const fs::path& path, const RawLayout& raw) {
  VolumeHeader header;
  header.format = "raw";
  for (int axis = 0; axis < 3; ++axis) {
    if (raw.size[axis] < 1)
      throw UsageError(fmt::format("the size is {},{},{}; give three numbers of at least 1",
                                   raw.size.x, raw.size.y, raw.size.z));
    header.size[static_cast<std::size_t>(axis)] = raw.size[axis];
  }
  const auto stored = volume_files::storedTypeOf(raw.type);
  if (!stored)
    throw UsageError(fmt::format(
        "there is no type '{}' of numbers; use u8, i8, u16, i16, u32, i32, f16, f32 or f64",
        raw.type));
  header.stored = *stored;
  header.isBigEndian = raw.isBigEndian;
  header.indexToWorld = volume_files::affineMap({raw.spacing.x, 0, 0}, {0, raw.spacing.y, 0},
                                                {0, 0, raw.spacing.z}, raw.origin);
  header.dataFile = path;
  header.offset = raw.skip;
  header.encoding = isGzipped(path) ? Encoding::CompressedFile : Encoding::Raw;
  header.mustFill = true;
  return header;
}

VolumeHeader headerOf(const fs::path& given, const ReadVolumeOptions& options) {
  const std::string format =
      volumeExtension(options.format.empty() ? given : fs::path(options.format));
  if (!isVolumeFormat(format))
    throw UsageError(fmt::format(
        "'{}' is no volume format; use nii, hdr, mha, mhd, nrrd, nhdr, mrc, map or raw", format));
  if ((format == "raw") != options.raw.has_value())
    throw UsageError(options.raw ? "--size and --type describe a raw file, and this one has a "
                                   "header; leave them out"
                                 : "a raw file has no header; give --size and --type");
  if (options.frame != 0 && format != "nii" && format != "hdr" && format != "img")
    throw UsageError("--frame chooses a volume of a NIfTI file; leave it out");
  if (given == "-") throw UsageError("a volume cannot be read from standard input; give a file");
  if (format == "raw") return rawHeader(given, *options.raw);
  fs::path path = given;
  if (format == "img") {  // the header of a pair is in the other file
    if (isGzipped(path)) path.replace_extension();
    path.replace_extension(".hdr");
    fs::path packed = path;
    packed += ".gz";
    std::error_code error;
    if (!fs::exists(path, error) && fs::exists(packed, error)) path = packed;
  }
  const std::string name = inputName(path);
  const FirstBytes first = readFirstBytes(path, volume_files::kMostHeaderBytes);
  const std::string_view bytes = first.bytes.view();
  if (format == "mha" || format == "mhd")
    return volume_files::readMetaImageHeader(path, bytes, name);
  if (format == "nrrd" || format == "nhdr") return volume_files::readNrrdHeader(path, bytes, name);
  if (format == "mrc" || format == "map") return volume_files::readMrcHeader(path, bytes, name);
  return volume_files::readNiftiHeader(path, bytes, name, options.frame);
}

}  // namespace

Volume readVolume(const fs::path& path, const ReadVolumeOptions& options) {
  const VolumeHeader header = headerOf(path, options);
  if (options.notes)
    options.notes->insert(options.notes->end(), header.notes.begin(), header.notes.end());
  return volume_files::loadNumbers(header, options);
}

VolumeFileInfo volumeFileInfo(const fs::path& path, const ReadVolumeOptions& options) {
  const VolumeHeader header = headerOf(path, options);
  VolumeFileInfo info;
  info.format = header.format;
  info.grid = volume_files::gridOf(header, inputName(path));
  info.storedType = volume_files::storedTypeName(header.stored);
  info.type = volume_files::typeInMemory(header.stored);
  info.scale = header.scale;
  info.encoding = header.encoding == Encoding::Raw    ? "raw"
                  : header.encoding == Encoding::Text ? "text"
                                                      : "gzip";
  info.isBigEndian = header.isBigEndian;
  return info;
}

bool isVolumeFormat(const fs::path& nameOrFormat) {
  static constexpr const char* kFormats[] = {"nii",  "hdr",  "img", "mha", "mhd",
                                             "nrrd", "nhdr", "mrc", "map", "raw"};
  const std::string format = volumeExtension(nameOrFormat);
  return std::find(std::begin(kFormats), std::end(kFormats), format) != std::end(kFormats);
}

bool isRawFormat(const fs::path& nameOrFormat) {
  return volumeExtension(nameOrFormat) == "raw";
}

}  // namespace levelset
