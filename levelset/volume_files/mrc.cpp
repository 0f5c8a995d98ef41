#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "levelset/error.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset::volume_files {
namespace {

using Imath::V3d;

constexpr std::size_t kMrcHeader = 1024;

/// Returns true for a header in big-endian order. The machine stamp decides; without a valid stamp,
/// the order in which the axis numbers are 1, 2 and 3.
bool isMrcBigEndian(std::string_view bytes) {
  const char stamp = bytes[212];
  if (stamp == 0x44) return false;
  if (stamp == 0x11) return true;
  const auto sum = [&](bool isSwapped) {
    const BinaryHeader h(bytes, isSwapped != (std::endian::native == std::endian::big));
    return std::int64_t{h.at<std::int32_t>(64)} + h.at<std::int32_t>(68) + h.at<std::int32_t>(72);
  };
  return sum(false) != 6 && sum(true) == 6;
}

StoredType mrcType(const BinaryHeader& h, const std::string& name) {
  constexpr std::int32_t kImodStamp = 1146047817, kSignedBytes = 1;
  switch (const auto mode = h.at<std::int32_t>(12)) {
    case 0:
      // IMOD wrote unsigned bytes before MRC2014; its stamp tells them apart.
      return h.at<std::int32_t>(152) == kImodStamp && (h.at<std::int32_t>(156) & kSignedBytes) == 0
                 ? StoredType::U8
                 : StoredType::I8;
    case 1:
      return StoredType::I16;
    case 2:
      return StoredType::F32;
    case 6:
      return StoredType::U16;
    case 12:
      return StoredType::F16;
    default:
      refuseFile(name,
                 fmt::format("has the MRC mode {}, which is not supported; convert it to mode "
                             "2 (32-bit floats)",
                             mode));
  }
}

/// Edges of the unit cell: a along x, b in the plane of x and y.
std::array<V3d, 3> cellEdges(const V3d& length, const V3d& degrees, const std::string& name) {
  const V3d angle = degrees * (std::numbers::pi / 180);
  // Right angles are exact.
  const auto cosine = [&](int n) { return degrees[n] == 90 ? 0.0 : std::cos(angle[n]); };
  const double sine = degrees[2] == 90 ? 1 : std::sin(angle[2]);
  const double y = (cosine(0) - cosine(1) * cosine(2)) / sine;
  const double rest = 1 - cosine(1) * cosine(1) - y * y;
  if (!(rest > 1e-6) || !(sine > 1e-3))
    refuseFile(name, fmt::format("has a unit cell with the angles {}, {} and {} degrees, which is "
                                 "no cell; repair its header",
                                 degrees.x, degrees.y, degrees.z));
  return {V3d(length.x, 0, 0), V3d(cosine(2), sine, 0) * length.y,
          V3d(cosine(1), y, std::sqrt(rest)) * length.z};
}

}  // namespace

VolumeHeader readMrcHeader(const std::filesystem::path& path, std::string_view bytes,
                           const std::string& name) {
  if (bytes.size() < kMrcHeader)
    refuseFile(name, "ends inside its header of 1024 bytes; download or create the file again");
  VolumeHeader header;
  header.format = "MRC";
  header.isBigEndian = isMrcBigEndian(bytes);
  const BinaryHeader h(bytes, header.isBigEndian != (std::endian::native == std::endian::big));
  const auto integers = [&](std::size_t at) {
    return std::array<std::int32_t, 3>{h.at<std::int32_t>(at), h.at<std::int32_t>(at + 4),
                                       h.at<std::int32_t>(at + 8)};
  };
  const auto vector = [&](std::size_t at) {
    return V3d(static_cast<double>(h.at<float>(at)), static_cast<double>(h.at<float>(at + 4)),
               static_cast<double>(h.at<float>(at + 8)));
  };
  const std::array<std::int32_t, 3> size = integers(0), start = integers(16);
  const std::array<std::int32_t, 3> intervals = integers(28);
  header.size = {size[0], size[1], size[2]};
  header.stored = mrcType(h, name);

  // Numbers of the crystal axes, 0 to 2, along i, j and k.
  std::array<std::int32_t, 3> order = integers(64);
  if (order == std::array<std::int32_t, 3>{0, 0, 0}) order = {1, 2, 3};
  std::array<bool, 3> isUsed{};
  for (std::int32_t& axis : order) {
    if (axis < 1 || axis > 3 || isUsed[static_cast<std::size_t>(axis - 1)])
      refuseFile(name, fmt::format("has the axes MAPC, MAPR, MAPS = {}, {}, {}, which are not 1, 2 "
                                   "and 3 in any order; repair its header",
                                   integers(64)[0], integers(64)[1], integers(64)[2]));
    isUsed[static_cast<std::size_t>(--axis)] = true;
  }
  const V3d length = vector(40), degrees = vector(52), origin = vector(196);
  V3d spacing(1);
  bool hasCell = true;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (intervals[a] > 0 && length[axis] > 0)
      spacing[axis] = length[axis] / intervals[a];
    else
      hasCell = false;
  }
  if (!hasCell)
    header.notes.emplace_back("the file states no size of the unit cell; the spacing is set to 1");
  const bool hasAngles = degrees.x > 0 && degrees.y > 0 && degrees.z > 0;
  const std::array<V3d, 3> edge = cellEdges(spacing, hasAngles ? degrees : V3d(90), name);
  // ORIGIN gives the position of the first point; files without it, from crystallography, give the
  // index of the first point in NXSTART, NYSTART and NZSTART.
  V3d first = origin;
  if (origin == V3d(0))
    for (std::size_t n = 0; n < 3; ++n)
      first += edge[static_cast<std::size_t>(order[n])] * static_cast<double>(start[n]);
  const auto along = [&](std::size_t n) { return edge[static_cast<std::size_t>(order[n])]; };
  header.indexToWorld = affineMap(along(0), along(1), along(2), first);

  const auto extended = h.at<std::int32_t>(92);
  if (extended < 0)
    refuseFile(name,
               fmt::format("has an extended header of {} bytes; repair its header", extended));
  header.offset = kMrcHeader + static_cast<std::uint64_t>(extended);
  header.dataFile = path;
  header.encoding = path.extension() == ".gz" ? Encoding::CompressedFile : Encoding::Raw;
  return header;
}

}  // namespace levelset::volume_files
