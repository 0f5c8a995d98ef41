#include <fmt/core.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "levelset/error.h"
#include "levelset/mesh_files/ply_header.h"
#include "levelset/mesh_files/ply_source.h"
#include "levelset/point_files/cloud_builder.h"

namespace levelset::point_files {
namespace {

using ply::Element;
using ply::Property;
using ply::Role;
using ply::Type;

/// Returns a cloud with one entry in each list that the points of the element fill.
PointCloud attributesOf(const Element& element) {
  PointCloud held;
  if (element.holdsNormals()) held.normals.resize(1);
  if (element.holdsColors()) held.colors.resize(1);
  if (element.has(Role::Radius)) held.radii.resize(1);
  if (element.has(Role::Weight)) held.weights.resize(1);
  return held;
}

template <typename Source>
class PointElementReader {
 public:
  PointElementReader(Source& source, CloudBuilder& builder) : source_(source), builder_(builder) {}

  void read(const Element& element) {
    if (element.properties.empty()) return;
    const bool isPoint = element.holdsVertices();
    if (isPoint) held_ = builder_.wantsAttributes() ? attributesOf(element) : PointCloud();
    of(Role::Alpha) = 1;
    for (std::size_t i = 0; i < element.count; ++i) {
      source_.begin(element, i);
      for (const Property& property : element.properties) readProperty(property, isPoint);
      source_.end();
      if (isPoint) addPoint();
    }
  }

 private:
  double& of(Role role) { return values_[static_cast<std::size_t>(role)]; }

  [[nodiscard]] bool isKept(Role role) const {
    if (role >= Role::X && role <= Role::Z) return true;
    if (role >= Role::Nx && role <= Role::Nz) return !held_.normals.empty();
    if (role >= Role::Red && role <= Role::Alpha) return !held_.colors.empty();
    if (role == Role::Radius) return !held_.radii.empty();
    return role == Role::Weight && !held_.weights.empty();
  }

  void readProperty(const Property& property, bool isPoint) {
    if (property.listCount) {
      const std::size_t count =
          ply::wholeNumber(source_.value(*property.listCount), "the length of a list",
                           builder_.name(), source_.place());
      return source_.skip(property.type, count);
    }
    if (!isPoint || !isKept(property.role)) return source_.skip(property.type, 1);
    const double value = source_.value(property.type);
    const bool isColor = property.role >= Role::Red && property.role <= Role::Alpha;
    of(property.role) =
        isColor && property.type < Type::Float
            ? ply::colorShare(value, property.type, builder_.name(), source_.place())
            : value;
  }

  void addPoint() {
    const FilePosition place = source_.place();
    builder_.addPosition({of(Role::X), of(Role::Y), of(Role::Z)}, place, source_.at());
    if (!held_.normals.empty())
      builder_.addNormal({of(Role::Nx), of(Role::Ny), of(Role::Nz)}, place);
    if (!held_.colors.empty()) {
      const auto part = [this](Role role) { return static_cast<float>(of(role)); };
      builder_.addColor({part(Role::Red), part(Role::Green), part(Role::Blue), part(Role::Alpha)},
                        place);
    }
    if (!held_.radii.empty()) builder_.addRadius(of(Role::Radius), place);
    if (!held_.weights.empty()) builder_.addWeight(of(Role::Weight), place);
  }

  Source& source_;
  CloudBuilder& builder_;
  std::array<double, ply::kRoles> values_ = {};
  PointCloud held_;
};

template <typename Source>
void readPointElements(const ply::Header& header, std::string_view data, CloudBuilder& builder) {
  Source source(data, header.lines, builder.name());
  PointElementReader<Source> reader(source, builder);
  for (const Element& element : header.elements) reader.read(element);
  requireNoTrailingData(data, static_cast<std::size_t>(source.at() - data.data()), builder.name(),
                        "the elements that its header promises");
}

const Element& pointElement(const ply::Header& header, const std::string& name) {
  for (const Element& element : header.elements)
    if (element.has(Role::X) && element.has(Role::Y) && element.has(Role::Z)) return element;
  failFile(name, "has no element 'vertex' with x, y and z; export the points again");
}

const char* realName(CoordinatePrecision precision) {
  return precision == CoordinatePrecision::Float ? "float" : "double";
}

}  // namespace

void readPlyPoints(std::string_view input, CloudBuilder& builder) {
  const ply::Header header = ply::readHeader(input, builder.name());
  const std::string_view data = input.substr(header.size);
  ply::checkPromises(header, data.size(), builder.name());
  const Element& points = pointElement(header, builder.name());
  builder.declarePrecision(points.widest(Role::X, Role::Z) == Type::Double
                               ? CoordinatePrecision::Double
                               : CoordinatePrecision::Float);
  builder.reserve(points.count, builder.wantsAttributes() ? attributesOf(points) : PointCloud());
  constexpr bool kLittle = std::endian::native == std::endian::little;
  switch (header.encoding) {
    case ply::Encoding::Ascii:
      return readPointElements<ply::AsciiSource>(header, data, builder);
    case ply::Encoding::Little:
      return readPointElements<ply::BinarySource<!kLittle>>(header, data, builder);
    case ply::Encoding::Big:
      return readPointElements<ply::BinarySource<kLittle>>(header, data, builder);
  }
}

bool plyLacksFaces(std::string_view head, const std::string& name) {
  bool hasPoints = false;
  for (const Element& element : ply::readHeader(head, name).elements) {
    if (element.holdsFaces() && element.count > 0) return false;
    // A list of faces of another name, such as triangle strips, belongs to a mesh.
    if (element.name == "face" || element.name == "tristrips") {
      if (element.count > 0) return false;
    }
    hasPoints = hasPoints || element.holdsVertices();
  }
  return hasPoints;
}

PointFileInfo plyPointInfo(std::string_view head, std::size_t fileSize, const std::string& name) {
  const ply::Header header = ply::readHeader(head, name);
  if (fileSize > 0) ply::checkPromises(header, fileSize - header.size, name);
  constexpr const char* kEncodings[] = {"ascii", "binary little endian", "binary big endian"};
  const Element& points = pointElement(header, name);
  return {fmt::format("ply, {}", kEncodings[static_cast<int>(header.encoding)]), points.count,
          describe(attributesOf(points))};
}

void writePlyPoints(ByteWriter& out, const PointCloud& cloud, const Progress& progress) {
  static_assert(std::endian::native == std::endian::little, "the header says little endian");
  const bool asFloat = cloud.precision == CoordinatePrecision::Float;
  const bool asBytes = hasByteColors(cloud), withAlpha = hasAlpha(cloud);
  std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {0}\nproperty {1} x\nproperty {1} y\n"
      "property {1} z\n",
      cloud.size(), realName(cloud.precision));
  if (!cloud.normals.empty()) header += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!cloud.colors.empty()) {
    for (const char* part : {"red", "green", "blue", "alpha"})
      if (withAlpha || part[0] != 'a')
        header += fmt::format("property {} {}\n", asBytes ? "uchar" : "float", part);
  }
  if (!cloud.radii.empty()) header += "property float radius\n";
  if (!cloud.weights.empty()) header += "property float confidence\n";
  out.write(header + "end_header\n");
  WriteProgress steps(progress, cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (asFloat)
      out.writeValue(Imath::V3f(cloud.positions[i]));
    else
      out.writeValue(cloud.positions[i]);
    if (!cloud.normals.empty()) out.writeValue(cloud.normals[i]);
    for (int part = 0; part < (cloud.colors.empty() ? 0 : withAlpha ? 4 : 3); ++part) {
      if (asBytes)
        out.writeValue(colorByte(cloud.colors[i][part]));
      else
        out.writeValue(cloud.colors[i][part]);
    }
    if (!cloud.radii.empty()) out.writeValue(cloud.radii[i]);
    if (!cloud.weights.empty()) out.writeValue(cloud.weights[i]);
    steps.step();
  }
}

}  // namespace levelset::point_files
