#include <fmt/core.h>

#include <cmath>

#include "levelset/error.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset::volume_files {
namespace {

using Imath::V3d;
namespace fs = std::filesystem;

constexpr std::int32_t kNifti1Size = 348, kNifti2Size = 540;

/// Fields of both versions of the header, in wide types.
struct NiftiFields {
  std::array<std::int64_t, 8> dim{};
  int datatype = 0;
  std::array<double, 8> pixdim{};
  double offset = 0, slope = 0, intercept = 0;
  int units = 0, qform = 0, sform = 0;
  V3d quaternion, qoffset;
  std::array<std::array<double, 4>, 3> rows{};  ///< the sform
  bool isPair = false;                          ///< the numbers are in the file .img
  int version = 1;
};

NiftiFields fieldsOfNifti1(const BinaryHeader& h) {
  NiftiFields f;
  for (std::size_t n = 0; n < 8; ++n) {
    f.dim[n] = h.at<std::int16_t>(40 + 2 * n);
    f.pixdim[n] = static_cast<double>(h.at<float>(76 + 4 * n));
  }
  const auto number = [&](std::size_t at) { return static_cast<double>(h.at<float>(at)); };
  f.datatype = h.at<std::int16_t>(70);
  f.offset = number(108);
  f.slope = number(112);
  f.intercept = number(116);
  f.units = h.at<std::uint8_t>(123);
  f.qform = h.at<std::int16_t>(252);
  f.sform = h.at<std::int16_t>(254);
  f.quaternion = {number(256), number(260), number(264)};
  f.qoffset = {number(268), number(272), number(276)};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      f.rows[row][column] = number(280 + 16 * row + 4 * column);
  return f;
}

NiftiFields fieldsOfNifti2(const BinaryHeader& h) {
  NiftiFields f;
  f.version = 2;
  for (std::size_t n = 0; n < 8; ++n) {
    f.dim[n] = h.at<std::int64_t>(16 + 8 * n);
    f.pixdim[n] = h.at<double>(104 + 8 * n);
  }
  f.datatype = h.at<std::int16_t>(12);
  f.offset = static_cast<double>(h.at<std::int64_t>(168));
  f.slope = h.at<double>(176);
  f.intercept = h.at<double>(184);
  f.qform = h.at<std::int32_t>(344);
  f.sform = h.at<std::int32_t>(348);
  f.units = h.at<std::int32_t>(500);
  f.quaternion = {h.at<double>(352), h.at<double>(360), h.at<double>(368)};
  f.qoffset = {h.at<double>(376), h.at<double>(384), h.at<double>(392)};
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 4; ++column)
      f.rows[row][column] = h.at<double>(400 + 32 * row + 8 * column);
  return f;
}

NiftiFields niftiFields(std::string_view bytes, const std::string& name, bool& isSwapped) {
  for (const bool swapped : {false, true}) {
    if (bytes.size() < 4) break;
    const BinaryHeader header(bytes, swapped);
    const auto size = header.at<std::int32_t>(0);
    if (size != kNifti1Size && size != kNifti2Size) continue;
    if (bytes.size() < static_cast<std::size_t>(size))
      refuseFile(
          name, fmt::format("ends inside its header of {} bytes; download or create the file again",
                            size));
    isSwapped = swapped;
    const std::string_view magic = bytes.substr(size == kNifti1Size ? 344 : 4, 3);
    NiftiFields fields = size == kNifti1Size ? fieldsOfNifti1(header) : fieldsOfNifti2(header);
    if (magic == (size == kNifti1Size ? "n+1" : "n+2")) return fields;
    fields.isPair = true;
    if (magic == (size == kNifti1Size ? "ni1" : "ni2")) return fields;
    refuseFile(
        name,
        "has no NIfTI mark in its header: it is damaged, or an ANALYZE 7.5 file, which has no "
        "orientation; convert it to NIfTI");
  }
  refuseFile(name, "is no NIfTI file: its first number is neither 348 nor 540; check the file");
}

StoredType niftiType(int datatype, const std::string& name) {
  switch (datatype) {
    case 2:
      return StoredType::U8;
    case 4:
      return StoredType::I16;
    case 8:
      return StoredType::I32;
    case 16:
      return StoredType::F32;
    case 64:
      return StoredType::F64;
    case 256:
      return StoredType::I8;
    case 512:
      return StoredType::U16;
    case 768:
      return StoredType::U32;
    case 1024:
      return StoredType::I64;
    case 1280:
      return StoredType::U64;
    default:
      refuseFile(name, fmt::format("stores numbers of the NIfTI type {}, which is not supported "
                                   "(complex, colour and 128-bit numbers are not); convert it to "
                                   "16-bit integers or 32-bit floats",
                                   datatype));
  }
}

/// Map of the qform: a rotation by a quaternion, the spacing, and a mirrored k axis if pixdim[0] is
/// negative.
Imath::M44d mapOfQform(const NiftiFields& f) {
  double b = f.quaternion.x, c = f.quaternion.y, d = f.quaternion.z;
  const double rest = 1 - (b * b + c * c + d * d);
  double a = 0;
  if (rest > 1e-7) {
    a = std::sqrt(rest);
  } else {
    const double length = std::sqrt(b * b + c * c + d * d);
    b /= length;
    c /= length;
    d /= length;
  }
  const double mirror = f.pixdim[0] < 0 ? -1 : 1;
  const V3d i(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)),
      j(2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)),
      k(2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - c * c - b * b);
  return affineMap(i * f.pixdim[1], j * f.pixdim[2], k * (f.pixdim[3] * mirror), f.qoffset);
}

Imath::M44d niftiMap(const NiftiFields& f, std::vector<std::string>& notes) {
  Imath::M44d map;
  if (f.sform > 0) {
    const auto column = [&](std::size_t n) {
      return V3d(f.rows[0][n], f.rows[1][n], f.rows[2][n]);
    };
    map = affineMap(column(0), column(1), column(2), column(3));
  } else if (f.qform > 0) {
    map = mapOfQform(f);
  } else {
    notes.emplace_back(
        "the file states no orientation; i, j and k are taken as right, anterior and superior");
    map = affineMap({f.pixdim[1], 0, 0}, {0, f.pixdim[2], 0}, {0, 0, f.pixdim[3]}, V3d(0));
  }
  // World units are millimetres.
  const int unit = f.units & 7;
  const double scale = unit == 1 ? 1000 : unit == 3 ? 0.001 : 1;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 3; ++column) map[row][column] *= scale;
  return map;
}

/// Name of the other file of a pair, .hdr and .img, each also with .gz.
fs::path partnerOf(const fs::path& path, const char* extension) {
  const bool isGz = path.extension() == ".gz";
  const fs::path plain = isGz ? fs::path(path).replace_extension() : path;
  fs::path partner = fs::path(plain).replace_extension(extension);
  std::error_code error;
  fs::path packed = partner;
  packed += ".gz";
  return !fs::exists(partner, error) && fs::exists(packed, error) ? packed : partner;
}

}  // namespace

VolumeHeader readNiftiHeader(const fs::path& path, std::string_view bytes, const std::string& name,
                             int frame) {
  VolumeHeader header;
  const NiftiFields f = niftiFields(bytes, name, header.isBigEndian);
  if constexpr (std::endian::native == std::endian::big) header.isBigEndian = !header.isBigEndian;
  header.format = f.version == 1 ? "NIfTI-1" : "NIfTI-2";
  if (f.dim[0] < 1 || f.dim[0] > 7)
    refuseFile(name, fmt::format("states {} dimensions, not 1 to 7; repair its header", f.dim[0]));
  std::array<std::int64_t, 7> size{1, 1, 1, 1, 1, 1, 1};
  for (std::size_t n = 0; n < static_cast<std::size_t>(f.dim[0]); ++n) size[n] = f.dim[n + 1];
  header.size = {size[0], size[1], size[2]};
  header.stored = niftiType(f.datatype, name);
  if (size[4] > 1 || size[5] > 1 || size[6] > 1)
    refuseFile(name, fmt::format("stores {} x {} x {} numbers at each point; extract one of them",
                                 size[4], size[5], size[6]));
  if (frame < 0 || frame >= std::max<std::int64_t>(size[3], 1))
    refuseFile(name, fmt::format("has {} volumes, so there is no --frame {}; the first is 0",
                                 size[3], frame));
  if (size[3] > 1 && frame == 0)
    header.notes.push_back(
        fmt::format("the file has {} volumes and the first is read; choose with --frame", size[3]));
  if (!(f.offset >= 0 && f.offset < 1e15))
    refuseFile(
        name, fmt::format("states that its numbers begin at byte {}; repair its header", f.offset));
  header.offset = static_cast<std::uint64_t>(f.offset);
  const std::uint64_t least = f.isPair ? 0 : f.version == 1 ? kNifti1Size : kNifti2Size;
  if (header.offset < least)
    refuseFile(name, fmt::format("states that its numbers begin at byte {}, inside its header; "
                                 "repair its header",
                                 header.offset));
  if (frame > 0) {
    // The product is at most 2⁶³ · 8 in double precision, so compare before converting.
    const double skipped = static_cast<double>(size[0]) * static_cast<double>(size[1]) *
                           static_cast<double>(size[2]) * frame *
                           static_cast<double>(storedTypeSize(header.stored));
    if (!(skipped >= 0 && skipped < 1e15)) refuseFile(name, "is too large; repair its header");
    header.offset += static_cast<std::uint64_t>(skipped);
  }
  if (f.slope != 0) header.scale = {f.slope, f.intercept};
  header.indexToWorld = niftiMap(f, header.notes);
  header.dataFile = f.isPair ? partnerOf(path, ".img") : path;
  header.encoding = header.dataFile.extension() == ".gz" ? Encoding::CompressedFile : Encoding::Raw;
  return header;
}

}  // namespace levelset::volume_files
