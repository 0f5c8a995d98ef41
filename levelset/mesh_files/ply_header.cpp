#include "levelset/mesh_files/ply_header.h"

#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <utility>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_parts.h"
#include "levelset/mesh_files/ply_source.h"

namespace levelset::ply {
namespace {

constexpr std::size_t kMaxHeader = 1 << 20;

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> result;
  std::size_t i = 0;
  while (i < line.size()) {
    const std::size_t begin = line.find_first_not_of(" \t\r", i);
    if (begin == std::string_view::npos) break;
    i = std::min(line.find_first_of(" \t\r", begin), line.size());
    result.push_back(line.substr(begin, i - begin));
  }
  return result;
}

class HeaderReader {
 public:
  HeaderReader(std::string_view input, const std::string& name) : input_(input), name_(name) {}

  Header read() {
    if (input_.starts_with("\xEF\xBB\xBF")) offset_ = 3;  // byte order mark
    if (words(nextLine()) != std::vector<std::string_view>{"ply"})
      failFile(name_, "does not begin with 'ply'; give its actual format");
    for (;;) {
      const auto line = words(nextLine());
      if (line.empty() || line[0] == "comment" || line[0] == "obj_info") continue;
      if (line[0] == "end_header") break;
      if (line[0] == "format")
        readFormat(line);
      else if (line[0] == "element")
        readElement(line);
      else if (line[0] == "property")
        readProperty(line);
      else
        fail(fmt::format("'{}' is not a keyword of a PLY header", line[0]));
    }
    if (!formatSeen_) fail("the header has no format line");
    for (Element& element : header_.elements) chooseUvs(element);
    header_.size = offset_;
    return std::move(header_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    failAt(name_, {"line", header_.lines}, what + "; export the mesh again");
  }

  std::string_view nextLine() {
    const std::size_t end = input_.substr(0, kMaxHeader).find('\n', offset_);
    ++header_.lines;
    if (end == std::string_view::npos) {
      if (header_.lines == 1) failFile(name_, "does not begin with 'ply'; give its actual format");
      fail("the header has no 'end_header' line");
    }
    const std::string_view line = input_.substr(offset_, end - offset_);
    offset_ = end + 1;
    return line;
  }

  void readFormat(const std::vector<std::string_view>& line) {
    const std::string_view format = line.size() > 1 ? line[1] : "";
    if (format == "ascii")
      header_.encoding = Encoding::Ascii;
    else if (format == "binary_little_endian")
      header_.encoding = Encoding::Little;
    else if (format == "binary_big_endian")
      header_.encoding = Encoding::Big;
    else
      fail(fmt::format("the format '{}' is unknown", format));
    formatSeen_ = true;
  }

  void readElement(const std::vector<std::string_view>& line) {
    Element element;
    if (line.size() < 3) fail("an element needs a name and a count");
    element.name = line[1];
    const auto [end, error] =
        std::from_chars(line[2].data(), line[2].data() + line[2].size(), element.count);
    if (error != std::errc{} || end != line[2].data() + line[2].size())
      fail(fmt::format("'{}' is not a number of elements", line[2]));
    if (element.name == "vertex")
      for (const Element& other : header_.elements)
        if (other.name == element.name) fail("the element 'vertex' occurs twice");
    header_.elements.push_back(std::move(element));
  }

  /// Chooses the first complete pair of texture coordinates (u and v, s and t, or texture_u and
  /// texture_v) and skips the others.
  static void chooseUvs(Element& element) {
    const auto holds = [&](Role role, int family) {
      return std::any_of(element.properties.begin(), element.properties.end(),
                         [&](const Property& p) { return p.role == role && p.family == family; });
    };
    int chosen = 0;
    for (const Property& p : element.properties)
      if (!chosen && p.family && holds(Role::U, p.family) && holds(Role::V, p.family))
        chosen = p.family;
    for (Property& p : element.properties)
      if (p.family && p.family != chosen) p.role = Role::Skip;
  }

  Type readType(std::string_view word) const {
    constexpr std::pair<const char*, Type> kNames[] = {
        {"char", Type::Int8},     {"int8", Type::Int8},     {"uchar", Type::Uint8},
        {"uint8", Type::Uint8},   {"short", Type::Int16},   {"int16", Type::Int16},
        {"ushort", Type::Uint16}, {"uint16", Type::Uint16}, {"int", Type::Int32},
        {"int32", Type::Int32},   {"uint", Type::Uint32},   {"uint32", Type::Uint32},
        {"float", Type::Float},   {"float32", Type::Float}, {"double", Type::Double},
        {"float64", Type::Double}};
    for (const auto& [name, type] : kNames)
      if (word == name) return type;
    fail(fmt::format("the type '{}' is unknown", word));
  }

  void readProperty(const std::vector<std::string_view>& line) {
    if (header_.elements.empty()) fail("a property precedes the first element");
    Element& element = header_.elements.back();
    const bool list = line.size() > 1 && line[1] == "list";
    if (line.size() < (list ? 5u : 3u)) fail("a property needs a type and a name");
    const std::string_view name = line[list ? 4 : 2];
    Property property{readType(line[list ? 3 : 1]), {}, Role::Skip};
    if (list) property.listCount = readType(line[2]);
    property.role = roleOf(element.name, name, list);
    if (property.role == Role::U || property.role == Role::V) property.family = familyOf(name);
    const auto isSame = [&](const Property& other) {
      return other.role == property.role && other.family == property.family;
    };
    if (property.role != Role::Skip &&
        std::any_of(element.properties.begin(), element.properties.end(), isSame)) {
      if (isAttribute(property.role) || isPointRole(property.role))
        property.role = Role::Skip;  // skips a repeated attribute: the first one counts
      else
        fail(fmt::format("the property '{}' occurs twice", name));
    }
    if (property.role >= Role::Red && property.role <= Role::Alpha && !isColorType(property.type))
      property.role = Role::Skip;
    if (element.name == "face") noteFaceAttributes(name);
    element.properties.push_back(property);
  }

  static int familyOf(std::string_view name) { return name.size() > 1 ? 3 : name < "u" ? 2 : 1; }

  void noteFaceAttributes(std::string_view name) {
    if (name == "texcoord") header_.unsupported.insert("texture coordinates of faces");
    if (name == "red" || name == "green" || name == "blue")
      header_.unsupported.insert("colours of faces");
    if (name == "nx" || name == "ny" || name == "nz")
      header_.unsupported.insert("normals of faces");
  }

  static Role roleOf(std::string_view element, std::string_view name, bool list) {
    if (element == "face" && list && (name == "vertex_indices" || name == "vertex_index"))
      return Role::Corners;
    if (element == "vertex" && !list && name.size() == 1) {
      if (name == "x") return Role::X;
      if (name == "y") return Role::Y;
      if (name == "z") return Role::Z;
    }
    if (element == "vertex" && !list)
      for (const auto& [known, role] : kAttributes)
        if (name == known) return role;
    return Role::Skip;
  }

  /// Returns true for types with a known value of full intensity: 255 for uchar, 65535 for ushort,
  /// 1 for float and double.
  static bool isColorType(Type type) {
    return type == Type::Uint8 || type == Type::Uint16 || type >= Type::Float;
  }
  static constexpr std::pair<std::string_view, Role> kAttributes[] = {
      {"nx", Role::Nx},        {"ny", Role::Ny},         {"nz", Role::Nz},
      {"u", Role::U},          {"v", Role::V},           {"s", Role::U},
      {"t", Role::V},          {"texture_u", Role::U},   {"texture_v", Role::V},
      {"red", Role::Red},      {"green", Role::Green},   {"blue", Role::Blue},
      {"alpha", Role::Alpha},  {"radius", Role::Radius}, {"confidence", Role::Weight},
      {"weight", Role::Weight}};

  std::string_view input_;
  const std::string& name_;
  Header header_;
  std::size_t offset_ = 0;
  bool formatSeen_ = false;
};

}  // namespace

Header readHeader(std::string_view input, const std::string& name) {
  return HeaderReader(input, name).read();
}

void checkPromises(const Header& header, std::size_t dataSize, const std::string& name) {
  std::size_t left = dataSize + 1;  // the last line of a text may lack its line end
  for (const Element& element : header.elements) {
    const std::size_t least = element.leastSize(header.encoding);
    if (least == 0) continue;
    if (element.count > left / least) {
      failFile(name,
               fmt::format("promises {} elements '{}', more than its {} bytes of data can hold; "
                           "it is truncated or its header is damaged: download or export it again",
                           element.count, element.name, dataSize));
    }
    left -= element.count * least;
  }
}

void checkHeader(const Header& header, std::size_t dataSize, const std::string& name) {
  checkPromises(header, dataSize, name);
  bool vertices = false, faces = false;
  for (const Element& element : header.elements) {
    if (element.has(Role::X) && element.has(Role::Y) && element.has(Role::Z)) vertices = true;
    faces = faces || element.holdsFaces();
  }
  if (!vertices) failFile(name, "has no element 'vertex' with x, y and z; export the mesh again");
  if (!faces) {
    failFile(name,
             "has no element 'face' with a list 'vertex_indices'; export the mesh with its faces");
  }
}

double colorShare(double value, Type type, const std::string& name, FilePosition place) {
  const double full = type == Type::Uint8 ? 255 : 65535;
  if (!(value >= 0 && value <= full) || std::floor(value) != value) {
    failAt(name, place,
           fmt::format("a colour holds {}, which is not an integer from 0 to {}; repair the "
                       "file, or read it without attributes (--no-attributes)",
                       value, full));
  }
  return static_cast<double>(static_cast<float>(value) / static_cast<float>(full));
}

std::uint64_t wholeNumber(double value, const char* what, const std::string& name,
                          FilePosition place) {
  constexpr double kLimit = 1e15;  // doubles represent integers exactly up to 9e15
  if (value >= 0 && value < kLimit) {
    const auto whole = static_cast<std::uint64_t>(value);
    if (static_cast<double>(whole) == value) return whole;
  }
  failAt(name, place,
         fmt::format(
             "{} is {}, which is not an integer from 0 to 1e15; repair the file or export it again",
             what, value));
}

}  // namespace levelset::ply
