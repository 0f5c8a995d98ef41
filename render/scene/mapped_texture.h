#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"

namespace render {

/// A piecewise linear map from a part of space to the space of a texture: a grid of cells whose
/// nodes have a position in both spaces. Each cell is two prisms of three tetrahedra
/// [Brodersen07 §9; Porumbescu05]. The map is linear in each tetrahedron. The corners of a
/// tetrahedron form a path along three edges of its cell, from the first corner of the cell to its
/// last. The path takes the three axes in one of six orders.
struct PrismShell {
  using Node = std::array<int, 3>;

  Node cells{};  ///< number of cells along each axis, at least 1
  /// Positions of the nodes in the space of the texture: coordinates along x, y and z, strictly
  /// ascending, cells + 1 of them along each axis; world units of the texture's band.
  std::array<std::vector<double>, 3> coordinates;
  Imath::V3d centre{0};  ///< origin of `offsets`, world units
  /// Positions of the nodes in the drawn space, by index(), relative to `centre`; world units.
  std::vector<Imath::V3f> offsets;

  /// Index of a node in `offsets`; the node's first coordinate varies fastest.
  [[nodiscard]] std::size_t index(const Node& node) const {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    return (at(node[2]) * at(cells[1] + 1) + at(node[1])) * at(cells[0] + 1) + at(node[0]);
  }
  /// Position of a node in the space of the texture.
  [[nodiscard]] Imath::V3d textureOf(const Node& node) const {
    return {coordinates[0][static_cast<std::size_t>(node[0])],
            coordinates[1][static_cast<std::size_t>(node[1])],
            coordinates[2][static_cast<std::size_t>(node[2])]};
  }
};

/// A level set that is drawn many times, once through each of several shells. Rays are transformed
/// into the space of the level set, so that there is one copy of its grid. Parts of the level set
/// outside a shell are not drawn. Mapped textures are lit and cast shadows like solids, but cannot
/// be used in the CSG expression. They are opaque.
struct MappedTexture {
  levelset::NarrowBand band;
  std::shared_ptr<const std::vector<PrismShell>> shells;
  Imath::C3f colour{0.66f, 0.62f, 0.56f};
  std::uint32_t id = 1;
  std::string name = {};
};

}  // namespace render
