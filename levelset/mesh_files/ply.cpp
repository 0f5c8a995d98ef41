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
#include "levelset/mesh_files/ply_source.h"

namespace levelset {
namespace {

using ply::AsciiSource;
using ply::BinarySource;
using ply::Element;
using ply::Encoding;
using ply::Header;
using ply::Property;
using ply::Role;
using ply::Type;

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
      of(property.role) =
          isColor && isWhole && hasColors_
              ? ply::colorShare(value, property.type, builder_.name(), source_.place())
              : value;
      if (property.type == Type::Float && ply::isAttribute(property.role)) requireFloat(value);
      return;
    }
    const std::size_t count =
        ply::wholeNumber(source_.value(*property.listCount), "the length of a list",
                         builder_.name(), source_.place());
    if (property.role != Role::Corners) return source_.skip(property.type, count);
    source_.requireList(property.type, count);
    corners_.resize(count);
    for (std::uint64_t& corner : corners_)
      corner = ply::wholeNumber(source_.value(property.type), "the index of a vertex",
                                builder_.name(), source_.place());
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

/// Marks the properties that only point clouds have as skipped.
void skipPointRoles(Header& header) {
  for (Element& element : header.elements)
    for (Property& p : element.properties)
      if (ply::isPointRole(p.role)) p.role = Role::Skip;
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
  skipPointRoles(header);
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
