#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "levelset/error.h"
#include "levelset/files/mesh_parts.h"

// The Polygon File Format: Greg Turk, "The PLY Polygon File Format", Stanford 1994.

namespace levelset {
namespace {

constexpr std::size_t kMaxHeader = 1 << 20;

enum class Type { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float, Double };
enum class Role { Skip, X, Y, Z, Nx, Ny, Nz, U, V, Red, Green, Blue, Alpha, Corners };
constexpr std::size_t kRoles = static_cast<std::size_t>(Role::Corners) + 1;
enum class Encoding { Ascii, Little, Big };

constexpr bool isAttribute(Role role) {
  return role >= Role::Nx && role <= Role::Alpha;
}

constexpr std::size_t sizeOf(Type type) {
  constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<int>(type)];
}

struct Property {
  Type type;
  std::optional<Type> listCount;  // set for a list
  Role role = Role::Skip;
  int family = 0;  // of texture coordinates: which of the pairs of names
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] bool has(Role role) const {
    return std::any_of(properties.begin(), properties.end(),
                       [role](const Property& p) { return p.role == role; });
  }
  [[nodiscard]] bool holdsVertices() const { return has(Role::X); }
  [[nodiscard]] bool holdsFaces() const { return has(Role::Corners); }
  [[nodiscard]] bool holdsNormals() const {
    return has(Role::Nx) && has(Role::Ny) && has(Role::Nz);
  }
  [[nodiscard]] bool holdsUvs() const { return has(Role::U) && has(Role::V); }
  [[nodiscard]] bool holdsColors() const {
    return has(Role::Red) && has(Role::Green) && has(Role::Blue);
  }
  /// The widest type among the properties from one role to another.
  [[nodiscard]] Type widest(Role from, Role to) const {
    Type widest = Type::Int8;
    for (const Property& p : properties)
      if (p.role >= from && p.role <= to) widest = std::max(widest, p.type);
    return widest;
  }
  /// Bytes that one element takes at least.
  [[nodiscard]] std::size_t leastSize(Encoding encoding) const {
    std::size_t size = 0;
    for (const Property& p : properties)
      size += encoding == Encoding::Ascii ? 2 : sizeOf(p.listCount.value_or(p.type));
    return size;
  }
};

struct Header {
  Encoding encoding = Encoding::Ascii;
  std::vector<Element> elements;
  std::size_t size = 0;   // bytes, up to the data
  std::size_t lines = 0;  // of text
  std::set<std::string> leftAside = {};
};

// === Header

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
      failFile(name_, "does not begin with 'ply'; give its true format");
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
        fail(fmt::format("'{}' is no word of a PLY header", line[0]));
    }
    if (!formatSeen_) fail("the header names no format");
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
      if (header_.lines == 1) failFile(name_, "does not begin with 'ply'; give its true format");
      fail("the header has no end");
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
      fail(fmt::format("the format '{}' is not known", format));
    formatSeen_ = true;
  }

  void readElement(const std::vector<std::string_view>& line) {
    Element element;
    if (line.size() < 3) fail("an element needs a name and a count");
    element.name = line[1];
    const auto [end, error] =
        std::from_chars(line[2].data(), line[2].data() + line[2].size(), element.count);
    if (error != std::errc{} || end != line[2].data() + line[2].size())
      fail(fmt::format("'{}' is no count of elements", line[2]));
    if (element.name == "vertex")
      for (const Element& other : header_.elements)
        if (other.name == element.name) fail("the element 'vertex' comes twice");
    header_.elements.push_back(std::move(element));
  }

  /// The first pair of names that is whole.
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
    constexpr std::pair<const char*, Type> names[] = {
        {"char", Type::Int8},     {"int8", Type::Int8},     {"uchar", Type::Uint8},
        {"uint8", Type::Uint8},   {"short", Type::Int16},   {"int16", Type::Int16},
        {"ushort", Type::Uint16}, {"uint16", Type::Uint16}, {"int", Type::Int32},
        {"int32", Type::Int32},   {"uint", Type::Uint32},   {"uint32", Type::Uint32},
        {"float", Type::Float},   {"float32", Type::Float}, {"double", Type::Double},
        {"float64", Type::Double}};
    for (const auto& [name, type] : names)
      if (word == name) return type;
    fail(fmt::format("the type '{}' is not known", word));
  }

  void readProperty(const std::vector<std::string_view>& line) {
    if (header_.elements.empty()) fail("a property stands before the first element");
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
      if (isAttribute(property.role))
        property.role = Role::Skip;  // the first counts
      else
        fail(fmt::format("the property '{}' comes twice", name));
    }
    if (property.role >= Role::Red && property.role <= Role::Alpha && !isColorType(property.type))
      property.role = Role::Skip;
    if (element.name == "face") noteOfFaces(name);
    element.properties.push_back(property);
  }

  static int familyOf(std::string_view name) { return name.size() > 1 ? 3 : name < "u" ? 2 : 1; }

  void noteOfFaces(std::string_view name) {
    if (name == "texcoord") header_.leftAside.insert("texture coordinates of faces");
    if (name == "red" || name == "green" || name == "blue")
      header_.leftAside.insert("colours of faces");
    if (name == "nx" || name == "ny" || name == "nz") header_.leftAside.insert("normals of faces");
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

  /// Those of which it is plain what is full.
  static bool isColorType(Type type) {
    return type == Type::Uint8 || type == Type::Uint16 || type >= Type::Float;
  }
  static constexpr std::pair<std::string_view, Role> kAttributes[] = {
      {"nx", Role::Nx},       {"ny", Role::Ny},   {"nz", Role::Nz},       {"u", Role::U},
      {"v", Role::V},         {"s", Role::U},     {"t", Role::V},         {"texture_u", Role::U},
      {"texture_v", Role::V}, {"red", Role::Red}, {"green", Role::Green}, {"blue", Role::Blue},
      {"alpha", Role::Alpha}};

  std::string_view input_;
  const std::string& name_;
  Header header_;
  std::size_t offset_ = 0;
  bool formatSeen_ = false;
};

/// Nothing promises more than the file can hold.
void checkPromises(const Header& header, std::size_t dataSize, const std::string& name) {
  std::size_t left = dataSize + 1;  // the last line of a text may lack its end
  for (const Element& element : header.elements) {
    const std::size_t least = element.leastSize(header.encoding);
    if (least == 0) continue;
    if (element.count > left / least) {
      failFile(name,
               fmt::format("promises {} elements '{}', more than its {} bytes of data can hold; "
                           "it was cut off or its header is damaged: fetch or export it again",
                           element.count, element.name, dataSize));
    }
    left -= element.count * least;
  }
}

/// What a mesh needs is there, and the file may hold it.
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

// === Data

template <typename T>
T load(const char* p, bool swap) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, p, sizeof(T));
  if (swap) std::reverse(bytes, bytes + sizeof(T));
  return std::bit_cast<T>(bytes);
}

template <bool kSwap>
class BinarySource {
 public:
  BinarySource(std::string_view data, std::size_t, const std::string& name)
      : p_(data.data()), end_(data.data() + data.size()), name_(name) {}

  void begin(const Element& element, std::size_t index) {
    element_ = &element;
    index_ = index;
  }
  void end() {}
  [[nodiscard]] Place place() const { return {element_->name.c_str(), index_}; }
  [[nodiscard]] const char* at() const { return p_; }

  double value(Type type) {
    require(sizeOf(type));
    const char* p = p_;
    p_ += sizeOf(type);
    switch (type) {
      case Type::Int8:
        return static_cast<signed char>(*p);
      case Type::Uint8:
        return static_cast<unsigned char>(*p);
      case Type::Int16:
        return load<std::int16_t>(p, kSwap);
      case Type::Uint16:
        return load<std::uint16_t>(p, kSwap);
      case Type::Int32:
        return load<std::int32_t>(p, kSwap);
      case Type::Uint32:
        return load<std::uint32_t>(p, kSwap);
      case Type::Float:
        return static_cast<double>(load<float>(p, kSwap));
      case Type::Double:
        return load<double>(p, kSwap);
    }
    return 0;
  }
  void skip(Type type, std::size_t count) {
    requireList(type, count);
    p_ += count * sizeOf(type);
  }
  /// A list of `count` values is there.
  void requireList(Type type, std::size_t count) {
    if (count > static_cast<std::size_t>(end_ - p_) / sizeOf(type)) failShort();
  }

 private:
  void require(std::size_t size) {
    if (static_cast<std::size_t>(end_ - p_) < size) failShort();
  }
  [[noreturn]] void failShort() const {
    failAt(name_, place(),
           "the file ends in the middle of it; it was cut off or is damaged: fetch or export it "
           "again");
  }

  const char* p_;
  const char* end_;
  const std::string& name_;
  const Element* element_ = nullptr;
  std::size_t index_ = 0;
};

/// One element a line; a line with too many values would shift all that follow.
class AsciiSource {
 public:
  AsciiSource(std::string_view data, std::size_t headerLines, const std::string& name)
      : cursor_(data, name, headerLines + 1), name_(name) {}

  void begin(const Element& element, std::size_t) { element_ = &element; }
  void end() {
    if (cursor_.skipBlanks(0))
      failAt(name_, place(),
             fmt::format("there are more values than an element '{}' has; export the mesh again",
                         element_->name));
  }
  [[nodiscard]] Place place() const { return cursor_.place(); }
  [[nodiscard]] const char* at() const { return cursor_.at(); }

  double value(Type type) {
    if (!cursor_.skipToToken(0)) failEnd();
    const double number = cursor_.number("a number");
    // What is declared float is one; beyond its range the caller should see what was written.
    const bool isFloat =
        type == Type::Float && std::abs(number) <= std::numeric_limits<float>::max();
    return isFloat ? static_cast<double>(static_cast<float>(number)) : number;
  }
  void skip(Type, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      if (!cursor_.skipToToken(0)) failEnd();
      static_cast<void>(cursor_.token());
    }
  }
  void requireList(Type, std::size_t count) {
    if (count > cursor_.remaining()) failEnd();
  }

 private:
  [[noreturn]] void failEnd() const {
    failAt(name_, place(),
           fmt::format(
               "the file ends within the elements '{}'; it was cut off or is damaged: fetch or "
               "export it again",
               element_->name));
  }

  TextCursor cursor_;
  const std::string& name_;
  const Element* element_ = nullptr;
};

template <typename Source>
class ElementReader {
 public:
  ElementReader(Source& source, MeshBuilder& builder) : source_(source), builder_(builder) {}

  void read(const Element& element) {
    if (element.properties.empty()) return;
    const bool vertices = element.holdsVertices(), faces = element.holdsFaces();
    if (vertices) declareAttributes(element);
    for (std::size_t i = 0; i < element.count; ++i) {
      source_.begin(element, i);
      for (const Property& property : element.properties) readProperty(property);
      source_.end();
      if (vertices) addVertex();
      if (faces) builder_.addFace(corners_, source_.place(), source_.at());
    }
  }

 private:
  void declareAttributes(const Element& element) {
    hasNormals_ = element.holdsNormals();
    hasUvs_ = element.holdsUvs();
    hasColors_ = element.holdsColors();
    MeshAttributes& attributes = builder_.attributes();
    attributes.precision = element.widest(Role::Nx, Role::V) == Type::Double
                               ? CoordinatePrecision::Double
                               : CoordinatePrecision::Float;
    attributes.colorPrecision = element.widest(Role::Red, Role::Alpha) > Type::Uint8
                                    ? ColorPrecision::Float
                                    : ColorPrecision::Byte;
    attributes.hasAlpha = hasColors_ && element.has(Role::Alpha);
    if (hasNormals_) attributes.normals.reserve(element.count);
    if (hasUvs_) attributes.uvs.reserve(element.count);
    if (hasColors_) attributes.colors.reserve(element.count);
    of(Role::Alpha) = 1;
  }

  void addVertex() {
    const Place place = source_.place();
    builder_.addVertex(of(Role::X), of(Role::Y), of(Role::Z), place, source_.at());
    if (hasNormals_) builder_.addNormal({of(Role::Nx), of(Role::Ny), of(Role::Nz)}, place);
    if (hasUvs_) builder_.addUv({of(Role::U), of(Role::V)}, place);
    if (hasColors_) {
      const auto part = [this](Role role) { return static_cast<float>(of(role)); };
      builder_.addColor({part(Role::Red), part(Role::Green), part(Role::Blue), part(Role::Alpha)},
                        place);
    }
  }

  double& of(Role role) { return values_[static_cast<std::size_t>(role)]; }

  void readProperty(const Property& property) {
    if (!property.listCount) {
      if (property.role == Role::Skip) return source_.skip(property.type, 1);
      const double value = source_.value(property.type);
      const bool isWhole = property.type < Type::Float;
      const bool isColor = property.role >= Role::Red && property.role <= Role::Alpha;
      of(property.role) = isColor && isWhole && hasColors_ ? share(value, property.type) : value;
      if (property.type == Type::Float && isAttribute(property.role)) requireFloat(value);
      return;
    }
    const std::size_t count =
        wholeNumber(source_.value(*property.listCount), "the length of a list");
    if (property.role != Role::Corners) return source_.skip(property.type, count);
    source_.requireList(property.type, count);
    corners_.resize(count);
    for (std::uint64_t& corner : corners_)
      corner = wholeNumber(source_.value(property.type), "the index of a vertex");
  }

  /// As text a number may be beyond its type; what is no number at all is told elsewhere.
  void requireFloat(double value) const {
    if (!std::isfinite(value) || std::abs(value) <= std::numeric_limits<float>::max()) return;
    failAt(builder_.name(), source_.place(),
           fmt::format("{} is beyond the range of float, 3.4e38, of which its property is; repair "
                       "the mesh, or read it bare, without what its vertices carry (--bare)",
                       value));
  }

  /// Of what the type can hold; the float next to it.
  double share(double value, Type type) const {
    const double full = type == Type::Uint8 ? 255 : 65535;
    if (!(value >= 0 && value <= full) || std::floor(value) != value) {
      failAt(builder_.name(), source_.place(),
             fmt::format("a colour holds {}, which is no whole number from 0 to {}; repair the "
                         "mesh, or read it bare, without what its vertices carry (--bare)",
                         value, full));
    }
    return static_cast<double>(static_cast<float>(value) / static_cast<float>(full));
  }

  std::uint64_t wholeNumber(double value, const char* what) const {
    constexpr double kLimit = 1e15;  // doubles count exactly up to 9e15
    if (value >= 0 && value < kLimit) {
      const auto whole = static_cast<std::uint64_t>(value);
      if (static_cast<double>(whole) == value) return whole;
    }
    failAt(builder_.name(), source_.place(),
           fmt::format("{} is {}; repair the mesh or export it again", what, value));
  }

  Source& source_;
  MeshBuilder& builder_;
  std::array<double, kRoles> values_ = {};
  bool hasNormals_ = false, hasUvs_ = false, hasColors_ = false;
  std::vector<std::uint64_t> corners_;
};

template <typename Source>
void readElements(const Header& header, std::string_view data, MeshBuilder& builder) {
  Source source(data, header.lines, builder.name());
  ElementReader<Source> reader(source, builder);
  for (const Element& element : header.elements) reader.read(element);
  requireNothingBehind(data, static_cast<std::size_t>(source.at() - data.data()), builder.name(),
                       "the elements that its header promises");
}

/// @return  were there any?
bool skipAttributes(Header& header) {
  bool any = false;
  for (Element& element : header.elements)
    for (Property& p : element.properties)
      if (isAttribute(p.role)) {
        p.role = Role::Skip;
        any = true;
      }
  return any;
}

/// Triangles cannot be more than the data can list; a header may claim what it likes.
void reserveElements(const Header& header, std::size_t dataSize, MeshBuilder& builder) {
  std::size_t vertices = 0, triangles = 0, attributeBytes = 0;
  for (const Element& element : header.elements) {
    if (element.holdsVertices()) {
      vertices = element.count;
      builder.declarePrecision(element.widest(Role::X, Role::Z) == Type::Double
                                   ? CoordinatePrecision::Double
                                   : CoordinatePrecision::Float);
      attributeBytes = element.count * ((element.holdsNormals() ? sizeof(Imath::V3d) : 0) +
                                        (element.holdsUvs() ? sizeof(Imath::V2d) : 0) +
                                        (element.holdsColors() ? sizeof(Imath::V4f) : 0));
    }
    for (const Property& p : element.properties) {
      if (p.role != Role::Corners) continue;
      const bool ascii = header.encoding == Encoding::Ascii;
      const std::size_t least = ascii ? 8 : sizeOf(*p.listCount) + 3 * sizeOf(p.type);
      triangles = std::min(element.count, dataSize / least + 1);
    }
  }
  builder.reserve(vertices, triangles, attributeBytes);
}

}  // namespace

void readPly(std::string_view input, MeshBuilder& builder) {
  Header header = HeaderReader(input, builder.name()).read();
  if (builder.wantsAttributes()) {
    for (const std::string& what : header.leftAside) builder.leaveAside(what);
  } else if (skipAttributes(header)) {
    builder.dropAttributes();
  }
  const std::string_view data = input.substr(header.size);
  checkHeader(header, data.size(), builder.name());
  reserveElements(header, data.size(), builder);
  constexpr bool kLittle = std::endian::native == std::endian::little;
  switch (header.encoding) {
    case Encoding::Ascii:
      return readElements<AsciiSource>(header, data, builder);
    case Encoding::Little:
      return readElements<BinarySource<!kLittle>>(header, data, builder);
    case Encoding::Big:
      return readElements<BinarySource<kLittle>>(header, data, builder);
  }
}

bool plyHoldsTriangles(std::string_view head, std::size_t fileSize, const std::string& name) {
  const Header header = HeaderReader(head, name).read();
  const bool ascii = header.encoding == Encoding::Ascii;
  double promised = 0;
  for (const Element& element : header.elements) {
    std::size_t least = element.leastSize(header.encoding);
    for (const Property& p : element.properties)
      if (p.role == Role::Corners) least += 3 * (ascii ? 2 : sizeOf(p.type));
    promised += static_cast<double>(element.count) * static_cast<double>(least);
  }
  return promised <= static_cast<double>(fileSize) - static_cast<double>(header.size) + 1;
}

MeshFileInfo plyInfo(std::string_view head, std::size_t fileSize, const std::string& name) {
  const Header header = HeaderReader(head, name).read();
  if (fileSize > 0) checkPromises(header, fileSize - header.size, name);
  constexpr const char* kEncodings[] = {"ascii", "binary little endian", "binary big endian"};
  MeshFileInfo info{fmt::format("ply, {}", kEncodings[static_cast<int>(header.encoding)]), 0, 0};
  for (const Element& element : header.elements) {
    if (element.holdsVertices()) {
      info.vertices = element.count;
      MeshAttributes held;  // one of each that there is
      if (element.holdsNormals()) held.normals.resize(1);
      if (element.holdsUvs()) held.uvs.resize(1);
      if (element.holdsColors()) held.colors.resize(1);
      info.attributes = describe(held);
    }
    if (element.holdsFaces()) info.faces = element.count;
  }
  return info;
}

}  // namespace levelset
