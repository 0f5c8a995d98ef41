#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "levelset/error.h"
#include "levelset/mesh_files/mesh_parts.h"
#include "levelset/mesh_files/ply_header.h"

namespace levelset {
namespace {

using ply::Element;
using ply::Encoding;
using ply::Header;
using ply::Property;
using ply::Role;
using ply::Type;

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
  [[nodiscard]] FilePosition place() const { return {element_->name.c_str(), index_}; }
  [[nodiscard]] const char* at() const { return p_; }

  double value(Type type) {
    require(ply::sizeOf(type));
    const char* p = p_;
    p_ += ply::sizeOf(type);
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
    p_ += count * ply::sizeOf(type);
  }
  /// Checks that a list of `count` values is present.
  void requireList(Type type, std::size_t count) {
    if (count > static_cast<std::size_t>(end_ - p_) / ply::sizeOf(type)) failShort();
  }

 private:
  void require(std::size_t size) {
    if (static_cast<std::size_t>(end_ - p_) < size) failShort();
  }
  [[noreturn]] void failShort() const {
    failAt(name_, place(),
           "the file ends within this element; it is truncated or damaged: download or export it "
           "again");
  }

  const char* p_;
  const char* end_;
  const std::string& name_;
  const Element* element_ = nullptr;
  std::size_t index_ = 0;
};

/// Reads one element per line. Refuses a line with too many values, which would shift the values of
/// all later elements.
class AsciiSource {
 public:
  AsciiSource(std::string_view data, std::size_t headerLines, const std::string& name)
      : cursor_(data, name, headerLines + 1), name_(name) {}

  void begin(const Element& element, std::size_t) { element_ = &element; }
  void end() {
    if (cursor_.skipBlanks(0))
      failAt(
          name_, place(),
          fmt::format(
              "there are more values on the line than an element '{}' has; export the mesh again",
              element_->name));
  }
  [[nodiscard]] FilePosition place() const { return cursor_.place(); }
  [[nodiscard]] const char* at() const { return cursor_.at(); }

  double value(Type type) {
    if (!cursor_.skipToToken(0)) failEnd();
    const double number = cursor_.number("a number");
    // A value declared float is rounded to float. A number beyond the range of float is returned as
    // written, so that the caller can refuse it.
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
               "the file ends within the elements '{}'; it is truncated or damaged: download or "
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
    const FilePosition place = source_.place();
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
      if (property.type == Type::Float && ply::isAttribute(property.role)) requireFloat(value);
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

  /// Refuses an attribute beyond the range of its type float, which an ASCII file can contain.
  /// MeshBuilder refuses numbers that are not finite.
  void requireFloat(double value) const {
    if (!std::isfinite(value) || std::abs(value) <= std::numeric_limits<float>::max()) return;
    failAt(builder_.name(), source_.place(),
           fmt::format("{} exceeds the range of the property's type float, 3.4e38; repair "
                       "the mesh, or read it without attributes (--no-attributes)",
                       value));
  }

  /// Returns an integer colour as a fraction of the maximum of its type (255 or 65535), rounded to
  /// float.
  double share(double value, Type type) const {
    const double full = type == Type::Uint8 ? 255 : 65535;
    if (!(value >= 0 && value <= full) || std::floor(value) != value) {
      failAt(builder_.name(), source_.place(),
             fmt::format("a colour holds {}, which is not an integer from 0 to {}; repair the "
                         "mesh, or read it without attributes (--no-attributes)",
                         value, full));
    }
    return static_cast<double>(static_cast<float>(value) / static_cast<float>(full));
  }

  std::uint64_t wholeNumber(double value, const char* what) const {
    constexpr double kLimit = 1e15;  // doubles represent integers exactly up to 9e15
    if (value >= 0 && value < kLimit) {
      const auto whole = static_cast<std::uint64_t>(value);
      if (static_cast<double>(whole) == value) return whole;
    }
    failAt(
        builder_.name(), source_.place(),
        fmt::format(
            "{} is {}, which is not an integer from 0 to 1e15; repair the mesh or export it again",
            what, value));
  }

  Source& source_;
  MeshBuilder& builder_;
  std::array<double, ply::kRoles> values_ = {};
  bool hasNormals_ = false, hasUvs_ = false, hasColors_ = false;
  std::vector<std::uint64_t> corners_;
};

template <typename Source>
void readElements(const Header& header, std::string_view data, MeshBuilder& builder) {
  Source source(data, header.lines, builder.name());
  ElementReader<Source> reader(source, builder);
  for (const Element& element : header.elements) reader.read(element);
  requireNoTrailingData(data, static_cast<std::size_t>(source.at() - data.data()), builder.name(),
                        "the elements that its header promises");
}

/// Marks the properties of all attributes as skipped.
/// @return true when the header has a property of an attribute
bool skipAttributes(Header& header) {
  bool any = false;
  for (Element& element : header.elements)
    for (Property& p : element.properties)
      if (ply::isAttribute(p.role)) {
        p.role = Role::Skip;
        any = true;
      }
  return any;
}

/// Reserves memory. A header may promise any number of triangles, so the size of the data limits
/// them.
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
      const std::size_t least = ascii ? 8 : ply::sizeOf(*p.listCount) + 3 * ply::sizeOf(p.type);
      triangles = std::min(element.count, dataSize / least + 1);
    }
  }
  builder.reserve(vertices, triangles, attributeBytes);
}

}  // namespace

void readPly(std::string_view input, MeshBuilder& builder) {
  Header header = ply::readHeader(input, builder.name());
  if (builder.wantsAttributes()) {
    for (const std::string& what : header.unsupported) builder.noteUnsupported(what);
  } else if (skipAttributes(header)) {
    builder.dropAttributes();
  }
  const std::string_view data = input.substr(header.size);
  ply::checkHeader(header, data.size(), builder.name());
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
  const Header header = ply::readHeader(head, name);
  const bool ascii = header.encoding == Encoding::Ascii;
  double promised = 0;
  for (const Element& element : header.elements) {
    std::size_t least = element.leastSize(header.encoding);
    for (const Property& p : element.properties)
      if (p.role == Role::Corners) least += 3 * (ascii ? 2 : ply::sizeOf(p.type));
    promised += static_cast<double>(element.count) * static_cast<double>(least);
  }
  return promised <= static_cast<double>(fileSize) - static_cast<double>(header.size) + 1;
}

MeshFileInfo plyInfo(std::string_view head, std::size_t fileSize, const std::string& name) {
  const Header header = ply::readHeader(head, name);
  if (fileSize > 0) ply::checkPromises(header, fileSize - header.size, name);
  constexpr const char* kEncodings[] = {"ascii", "binary little endian", "binary big endian"};
  MeshFileInfo info{fmt::format("ply, {}", kEncodings[static_cast<int>(header.encoding)]), 0, 0};
  for (const Element& element : header.elements) {
    if (element.holdsVertices()) {
      info.vertices = element.count;
      MeshAttributes held;  // one entry for each attribute in the file, so that describe() names it
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
