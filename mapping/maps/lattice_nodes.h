#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <vector>

#include "mapping/patches/patch.h"

namespace mapping {

/// Extent of a lattice beyond the unit cube of a patch, so that the band of a texture ends inside
/// the lattice.
struct LatticeBorder {
  /// Depth of the texture below w = 0; if negative, its lift above w = 1; in w.
  double embedDepth = 0;
  /// Further margin on all six sides, world units; 0: no margin.
  double rim = 0;
  /// Texture coordinates that the outer cells reach on all sides, if they are further out than the
  /// margin; empty: none.
  Imath::Box3d reach = {};
  /// True: the outer cells are no wider than `rim` and `reach` need. False: they are at least as
  /// wide as the inner ones.
  bool isTight = false;
};

/// Nodes of a lattice: a grid with the same counts on every layer.
struct LatticeNodes {
  using Node = std::array<int, 3>;

  std::array<int, 3> cells{};  ///< number of cells along u, v, w
  /// Texture coordinates of the nodes, along u, v, w.
  std::array<std::vector<double>, 3> coordinates;
  std::vector<Imath::V3d> positions;  ///< world positions, by index()

  [[nodiscard]] std::size_t index(const Node& node) const {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    return (at(node[2]) * at(cells[1] + 1) + at(node[1])) * at(cells[0] + 1) + at(node[0]);
  }
  [[nodiscard]] const Imath::V3d& position(const Node& node) const {
    return positions[index(node)];
  }
  [[nodiscard]] Imath::V3d textureOf(const Node& node) const {
    return {coordinates[0][static_cast<std::size_t>(node[0])],
            coordinates[1][static_cast<std::size_t>(node[1])],
            coordinates[2][static_cast<std::size_t>(node[2])]};
  }
};

/// Builds the nodes from the particles of a patch. Layers with fewer particles than the largest
/// layer are refined on a smooth surface through their particles.
/// @param border  extent of the lattice beyond the layers and sides, continued linearly
[[nodiscard]] LatticeNodes latticeNodes(const Patch& patch, const LatticeBorder& border);

}  // namespace mapping
