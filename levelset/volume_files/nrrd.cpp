#include <fmt/core.h>

#include <cmath>
#include <map>

#include "levelset/error.h"
#include "levelset/volume_files/volume_header.h"

namespace levelset::volume_files {
namespace {

using Imath::V3d;

struct NrrdFields {
  std::map<std::string, std::string, std::less<>> values;
  std::size_t end = 0;  ///< position behind the header

  [[nodiscard]] std::string get(std::initializer_list<std::string_view> names) const {
    for (const std::string_view name : names)
      if (const auto at = values.find(name); at != values.end()) return at->second;
    return {};
  }
};

NrrdFields nrrdFields(std::string_view bytes, const std::string& name) {
  if (!bytes.starts_with("NRRD000"))
    refuseFile(name, "is no NRRD file: it does not begin with NRRD000; check the file");
  NrrdFields fields;
  while (fields.end < bytes.size()) {
    const std::size_t stop = bytes.find('\n', fields.end);
    std::string_view line = bytes.substr(fields.end, std::min(stop, bytes.size()) - fields.end);
    const bool isFirst = fields.end == 0;
    fields.end = std::min(stop, bytes.size() - 1) + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.empty()) return fields;
    if (isFirst || line.front() == '#') continue;
    const std::size_t colon = line.find(':');
    if (colon == std::string_view::npos)
      refuseFile(name, fmt::format("has the line '{}' without a colon in its header; repair it",
                                   line.substr(0, 60)));
    if (line.substr(colon).starts_with(":=")) continue;  // a key of the user
    fields.values[lowered(trimmed(line.substr(0, colon)))] = trimmed(line.substr(colon + 1));
  }
  if (bytes.size() >= kMostHeaderBytes)
    refuseFile(name, "has no empty line that ends its header; check the file");
  return fields;
}

StoredType nrrdType(const std::string& type, const std::string& name) {
  static constexpr std::pair<const char*, StoredType> kTypes[] = {
      {"signed char", StoredType::I8},
      {"int8", StoredType::I8},
      {"int8_t", StoredType::I8},
      {"uchar", StoredType::U8},
      {"unsigned char", StoredType::U8},
      {"uint8", StoredType::U8},
      {"uint8_t", StoredType::U8},
      {"short", StoredType::I16},
      {"short int", StoredType::I16},
      {"signed short", StoredType::I16},
      {"signed short int", StoredType::I16},
      {"int16", StoredType::I16},
      {"int16_t", StoredType::I16},
      {"ushort", StoredType::U16},
      {"unsigned short", StoredType::U16},
      {"unsigned short int", StoredType::U16},
      {"uint16", StoredType::U16},
      {"uint16_t", StoredType::U16},
      {"int", StoredType::I32},
      {"signed int", StoredType::I32},
      {"int32", StoredType::I32},
      {"int32_t", StoredType::I32},
      {"uint", StoredType::U32},
      {"unsigned int", StoredType::U32},
      {"uint32", StoredType::U32},
      {"uint32_t", StoredType::U32},
      {"longlong", StoredType::I64},
      {"long long", StoredType::I64},
      {"int64", StoredType::I64},
      {"int64_t", StoredType::I64},
      {"ulonglong", StoredType::U64},
      {"unsigned long long", StoredType::U64},
      {"uint64", StoredType::U64},
      {"uint64_t", StoredType::U64},
      {"float", StoredType::F32},
      {"double", StoredType::F64}};
  for (const auto& [word, stored] : kTypes)
    if (type == word) return stored;
  refuseFile(name, fmt::format("has the type '{}', which is not supported; convert it to short or "
                               "float",
                               type));
}

/// Reads "(x,y,z)". @return false if the text begins with no vector
bool takeVector(std::string_view& text, V3d& out) {
  text = trimmed(text);
  const std::size_t close = text.find(')');
  if (!text.starts_with('(') || close == std::string_view::npos) return false;
  const std::vector<double> numbers = numbersIn<double>(text.substr(1, close - 1), 3, ",");
  if (numbers.empty()) return false;
  out = V3d(numbers[0], numbers[1], numbers[2]);
  text.remove_prefix(close + 1);
  return true;
}

Imath::M44d nrrdMap(const NrrdFields& fields, const std::string& name,
                    std::vector<std::string>& notes) {
  std::array<V3d, 3> axis = {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
  V3d origin(0);
  if (const std::string directions = fields.get({"space directions"}); !directions.empty()) {
    std::string_view rest = directions;
    for (V3d& one : axis)
      if (!takeVector(rest, one))
        refuseFile(name, fmt::format("has the space directions '{}', which are not three vectors; "
                                     "repair them",
                                     directions));
  } else if (const std::string spacings = fields.get({"spacings"}); !spacings.empty()) {
    const std::vector<double> numbers = numbersIn<double>(spacings, 3);
    if (numbers.empty())
      refuseFile(
          name,
          fmt::format("has the spacings '{}', which are not three numbers; repair them", spacings));
    for (std::size_t a = 0; a < 3; ++a)  // NaN: unknown
      if (!std::isnan(numbers[a])) axis[a] *= numbers[a];
  }
  if (const std::string text = fields.get({"space origin"}); !text.empty()) {
    std::string_view rest = text;
    if (!takeVector(rest, origin))
      refuseFile(name,
                 fmt::format("has the space origin '{}', which is no vector; repair it", text));
  }
  Imath::M44d map = affineMap(axis[0], axis[1], axis[2], origin);
  const std::string space = lowered(fields.get({"space"}));
  if (space == "left-posterior-superior" || space == "lps") {
    turnLpsIntoRas(map);
  } else if (space == "left-anterior-superior" || space == "las") {
    for (int row = 0; row < 4; ++row) map[row][0] = -map[row][0];
  } else if (space.empty()) {
    notes.emplace_back("the file names no space; its coordinates are used as they are");
  }
  return map;
}

}  // namespace

VolumeHeader readNrrdHeader(const std::filesystem::path& path, std::string_view bytes,
                            const std::string& name) {
  const NrrdFields fields = nrrdFields(bytes, name);
  VolumeHeader header;
  header.format = "NRRD";
  if (const std::string dimension = fields.get({"dimension"}); dimension != "3")
    refuseFile(name, fmt::format("has the dimension '{}', but a volume has 3; extract a volume",
                                 dimension));
  const std::vector<std::int64_t> size = numbersIn<std::int64_t>(fields.get({"sizes"}), 3);
  if (size.empty())
    refuseFile(name, fmt::format("has the sizes '{}', which are not three whole numbers; repair "
                                 "them",
                                 fields.get({"sizes"})));
  header.size = {size[0], size[1], size[2]};
  header.stored = nrrdType(lowered(fields.get({"type"})), name);
  const std::string endian = lowered(fields.get({"endian"}));
  header.isBigEndian = endian == "big";
  const std::string encoding = lowered(fields.get({"encoding"}));
  if (encoding == "raw")
    header.encoding = Encoding::Raw;
  else if (encoding == "gzip" || encoding == "gz")
    header.encoding = Encoding::Compressed;
  else if (encoding == "txt" || encoding == "text" || encoding == "ascii")
    header.encoding = Encoding::Text;
  else
    refuseFile(name, fmt::format("has the encoding '{}', which is not supported; convert it to "
                                 "raw, gzip or ascii",
                                 encoding));
  if (header.encoding != Encoding::Text && storedTypeSize(header.stored) > 1 && endian != "big" &&
      endian != "little")
    refuseFile(name, fmt::format("has the byte order '{}', not big or little; add the line "
                                 "'endian: little' to its header",
                                 endian));
  header.indexToWorld = nrrdMap(fields, name, header.notes);

  // === Place of the numbers
  const std::string file = fields.get({"data file", "datafile"});
  if (file.starts_with("LIST") || file.find('%') != std::string::npos ||
      file.find(' ') != std::string::npos)
    refuseFile(name, fmt::format("has its numbers in several files ('{}'), which is not supported; "
                                 "join them to one file",
                                 file));
  header.dataFile = file.empty() ? path : path.parent_path() / file;
  header.offset = file.empty() ? fields.end : 0;
  const auto skip = [&](std::initializer_list<std::string_view> names) {
    const std::string text = fields.get(names);
    const auto number = text.empty() ? 0 : numberIn<std::int64_t>(text);
    if (!number || *number < -1)
      refuseFile(name, fmt::format("has '{}: {}', which is no number of {}; repair it",
                                   *names.begin(), text, *names.begin()));
    return *number;
  };
  const std::int64_t lines = skip({"line skip", "lineskip"}),
                     count = skip({"byte skip", "byteskip"});
  if (lines < 0) refuseFile(name, "has a negative 'line skip'; repair it");
  header.lines = static_cast<std::uint64_t>(lines);
  if (count == -1 && header.encoding == Encoding::Raw)
    header.isAtEnd = true;
  else if (count < 0 || (count > 0 && header.encoding == Encoding::Compressed))
    refuseFile(name, "has a 'byte skip' that its encoding does not support; write it as raw");
  else
    header.behindLines = static_cast<std::uint64_t>(count);
  return header;
}

}  // namespace levelset::volume_files
