#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

/// Header of a PLY file. Greg Turk, "The PLY Polygon File Format", Stanford 1994.
namespace levelset::ply {

enum class Type { Int8, Uint8, Int16, Uint16, Int32, Uint32, Float, Double };
enum class Role {
  Skip,
  X,
  Y,
  Z,
  Nx,
  Ny,
  Nz,
  U,
  V,
  Red,
  Green,
  Blue,
  Alpha,
  Radius,
  Weight,
  Corners
};
constexpr std::size_t kRoles = static_cast<std::size_t>(Role::Corners) + 1;
enum class Encoding { Ascii, Little, Big };

constexpr bool isAttribute(Role role) {
  return role >= Role::Nx && role <= Role::Alpha;
}

/// Returns true for properties that point clouds have and meshes do not.
constexpr bool isPointRole(Role role) {
  return role == Role::Radius || role == Role::Weight;
}

constexpr std::size_t sizeOf(Type type) {
  constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<int>(type)];
}

/// Property of an element, in the order of the data.
struct Property {
  Type type;
  std::optional<Type> listCount;  ///< type of the length of a list; empty: no list
  Role role = Role::Skip;
  int family = 0;  ///< texture coordinate: 1 for u and v, 2 for s and t, 3 for texture_u and
                   ///< texture_v; else 0
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
  /// Returns the widest type among the properties with roles from `from` to `to`.
  [[nodiscard]] Type widest(Role from, Role to) const {
    Type widest = Type::Int8;
    for (const Property& p : properties)
      if (p.role >= from && p.role <= to) widest = std::max(widest, p.type);
    return widest;
  }
  /// Minimum size of one element in bytes.
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
  std::size_t size = 0;                    ///< size of the header in bytes; the data follows
  std::size_t lines = 0;                   ///< number of lines of the header
  std::set<std::string> unsupported = {};  ///< names of attributes that a TriMesh cannot hold
};

/// Reads the header of a PLY file.
/// @param input  the complete file, or its start including the header
/// @throws InvalidInput with the line number
[[nodiscard]] Header readHeader(std::string_view input, const std::string& name);

/// Checks that the file can hold all elements that the header promises.
/// @param dataSize  number of bytes after the header
/// @throws InvalidInput
void checkPromises(const Header& header, std::size_t dataSize, const std::string& name);

/// Checks that the header has vertices and faces, and that the file can hold all elements.
/// @param dataSize  number of bytes after the header
/// @throws InvalidInput
void checkHeader(const Header& header, std::size_t dataSize, const std::string& name);

}  // namespace levelset::ply
