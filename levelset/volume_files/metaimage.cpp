#include <fmt/core.h>

#include <map>

#include "levelset/error.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset::volume_files {
namespace {

using Imath::V3d;

/// The fields of a header, and the position behind it.
struct MetaFields {
  std::map<std::string, std::string, std::less<>> values;
  std::size_t end = 0;

  /// Returns the value of the first of the names that the header has; empty: none.
  [[nodiscard]] std::string get(std::initializer_list<std::string_view> names) const {
    for (const std::string_view name : names)
      if (const auto at = values.find(name); at != values.end()) return at->second;
    return {};
  }
  [[nodiscard]] bool isTrue(std::initializer_list<std::string_view> names) const {
    const std::string value = lowered(get(names));
    return value == "true" || value == "1";
  }
};

MetaFields metaFields(std::string_view bytes, const std::string& name) {
  MetaFields fields;
  while (fields.end < bytes.size()) {
    const std::size_t stop = bytes.find('\n', fields.end);
    const std::string_view line =
        trimmed(bytes.substr(fields.end, std::min(stop, bytes.size()) - fields.end));
    fields.end = std::min(stop, bytes.size() - 1) + 1;
    if (line.empty()) continue;
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) break;
    const std::string key(trimmed(line.substr(0, equals)));
    fields.values[key] = trimmed(line.substr(equals + 1));
    if (key == "ElementDataFile") return fields;
  }
  refuseFile(name,
             "has no line 'ElementDataFile = ...' at the end of its header, so it is no MetaImage "
             "or is damaged; check the file");
}

StoredType metaType(const std::string& type, const std::string& name) {
  static constexpr std::pair<const char*, StoredType> kTypes[] = {
      {"MET_UCHAR", StoredType::U8},       {"MET_CHAR", StoredType::I8},
      {"MET_USHORT", StoredType::U16},     {"MET_SHORT", StoredType::I16},
      {"MET_UINT", StoredType::U32},       {"MET_INT", StoredType::I32},
      {"MET_ULONG", StoredType::U32},      {"MET_LONG", StoredType::I32},
      {"MET_ULONG_LONG", StoredType::U64}, {"MET_LONG_LONG", StoredType::I64},
      {"MET_FLOAT", StoredType::F32},      {"MET_DOUBLE", StoredType::F64}};
  for (const auto& [word, stored] : kTypes)
    if (type == word) return stored;
  refuseFile(name, fmt::format("has the ElementType '{}', which is not supported; convert it to "
                               "MET_SHORT or MET_FLOAT",
                               type));
}

}  // namespace

VolumeHeader readMetaImageHeader(const std::filesystem::path& path, std::string_view bytes,
                                 const std::string& name) {
  const MetaFields fields = metaFields(bytes, name);
  const auto numbers = [&](std::initializer_list<std::string_view> names, std::size_t count) {
    const std::string text = fields.get(names);
    std::vector<double> read = numbersIn<double>(text, count);
    if (read.empty() && !text.empty())
      refuseFile(name, fmt::format("has the line '{} = {}', which needs {} numbers; repair it",
                                   *names.begin(), text, count));
    return read;
  };
  VolumeHeader header;
  header.format = "MetaImage";
  if (const std::string dims = fields.get({"NDims"}); dims != "3")
    refuseFile(name, fmt::format("has NDims = '{}', but a volume has 3; extract a volume", dims));
  const std::vector<std::int64_t> size = numbersIn<std::int64_t>(fields.get({"DimSize"}), 3);
  if (size.empty())
    refuseFile(name, fmt::format("has DimSize = '{}', which is not three whole numbers; repair it",
                                 fields.get({"DimSize"})));
  header.size = {size[0], size[1], size[2]};
  header.stored = metaType(fields.get({"ElementType"}), name);
  if (const std::string channels = fields.get({"ElementNumberOfChannels"});
      !channels.empty() && channels != "1")
    refuseFile(name, fmt::format("has {} numbers at each point; extract one of them", channels));
  header.isBigEndian = fields.isTrue({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"});

  // === Orientation, in LPS
  const std::vector<double> spacing = numbers({"ElementSpacing", "ElementSize"}, 3);
  const std::vector<double> origin = numbers({"Offset", "Position", "Origin"}, 3);
  const std::vector<double> axes = numbers({"TransformMatrix", "Rotation", "Orientation"}, 9);
  std::array<V3d, 3> axis = {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
  for (std::size_t a = 0; a < 3; ++a) {
    if (!axes.empty()) axis[a] = V3d(axes[3 * a], axes[3 * a + 1], axes[3 * a + 2]);
    if (!spacing.empty()) axis[a] *= spacing[a];
  }
  header.indexToWorld = affineMap(axis[0], axis[1], axis[2],
                                  origin.empty() ? V3d(0) : V3d(origin[0], origin[1], origin[2]));
  turnLpsIntoRas(header.indexToWorld);

  if (const auto slope = numbers({"ElementToIntensityFunctionSlope"}, 1); !slope.empty())
    header.scale.slope = slope[0];
  if (const auto shift = numbers({"ElementToIntensityFunctionOffset"}, 1); !shift.empty())
    header.scale.intercept = shift[0];

  // === Place of the numbers
  const std::string file = fields.get({"ElementDataFile"});
  if (file.empty() || file.find('%') != std::string::npos || file.starts_with("LIST"))
    refuseFile(name, fmt::format("has its numbers in several files (ElementDataFile = '{}'), which "
                                 "is not supported; join them to one file",
                                 file));
  const bool isLocal = file == "LOCAL" || file == "Local" || file == "local";
  header.dataFile = isLocal ? path : path.parent_path() / file;
  if (isLocal) header.offset = fields.end;
  if (const auto skip = numbers({"HeaderSize"}, 1); !skip.empty()) {
    if (skip[0] == -1)
      header.isAtEnd = true;
    else if (skip[0] >= 0 && skip[0] < 1e15)
      header.offset += static_cast<std::uint64_t>(skip[0]);
    else
      refuseFile(name, fmt::format("has HeaderSize = {}; repair it", skip[0]));
  }
  if (fields.isTrue({"CompressedData"}))
    header.encoding = Encoding::Compressed;
  else if (const std::string binary = fields.get({"BinaryData"});
           !binary.empty() && !fields.isTrue({"BinaryData"}))
    header.encoding = Encoding::Text;
  if (header.isAtEnd && header.encoding != Encoding::Raw)
    refuseFile(name, "has HeaderSize = -1 with numbers that are not raw; give the size");
  return header;
}

}  // namespace levelset::volume_files
