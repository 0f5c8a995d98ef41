#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>

#include "mapping/maps/lattice_nodes.h"
#include "mapping/patches/patch.h"

namespace mapping {

/// One of the six tetrahedra of a cell [Brodersen07 §9]. The cell is two prisms, one over each
/// triangular half of its bottom. Each prism is three tetrahedra that share the cell's first and
/// last corner. The corners of every tetrahedron form a path along three edges of the cell, from
/// its first corner (least u, v, w) to its last. The path takes the three axes in one of six
/// orders. So the neighbours of a tetrahedron follow from its order and need not be stored.
struct Tetrahedron {
  std::array<int, 3> cell{};
  int order = 0;  ///< 0 … 5, see Lattice::kOrders
};

/// The particles of a patch as a grid of nodes with the same counts on every layer, split into
/// tetrahedra. Outer cells, beyond the particles, continue the grid linearly.
class Lattice {
 public:
  /// Axes (u = 0, v = 1, w = 2) in the order of a tetrahedron's path.
  static constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {0, 2, 1}, {2, 0, 1}, {1, 0, 2}, {1, 2, 0}, {2, 1, 0}}};
  using Corners = std::array<Imath::V3d, 4>;

  /// Builds the grid. Layers with fewer particles than the largest layer are refined on a smooth
  /// surface through their particles.
  /// @param border  extent of the lattice beyond the layers and sides, continued linearly; if
  ///         border.rim > 0, the outer cells along u and v are at least as wide as the inner ones
  Lattice(const Patch& patch, const LatticeBorder& border) : nodes_(latticeNodes(patch, border)) {}

  [[nodiscard]] const std::array<int, 3>& cells() const { return nodes_.cells; }
  [[nodiscard]] std::size_t cellCount() const;
  [[nodiscard]] std::size_t nodeCount() const { return nodes_.positions.size(); }

  /// World positions of a tetrahedron's corners, along its path.
  [[nodiscard]] Corners corners(const Tetrahedron& t) const;
  /// Texture coordinates of a tetrahedron's corners, along its path.
  [[nodiscard]] Corners textureCorners(const Tetrahedron& t) const;
  /// Box of a cell in texture coordinates.
  [[nodiscard]] Imath::Box3d textureBox(const std::array<int, 3>& cell) const;
  /// World box of a cell.
  [[nodiscard]] Imath::Box3d worldBox(const std::array<int, 3>& cell) const;
  /// True if a face of the cell lies on the border of the lattice.
  [[nodiscard]] bool isOutermost(const std::array<int, 3>& cell) const;

  /// Moves `t` to its neighbour across the face opposite `corner`. Returns false at the border.
  [[nodiscard]] bool cross(Tetrahedron& t, int corner) const;

  /// Finds the tetrahedron that contains a point of texture space. Returns false outside the
  /// lattice.
  [[nodiscard]] bool locate(const Imath::V3d& uvw, Tetrahedron& t) const;

 private:
  LatticeNodes nodes_;
};

/// Barycentric coordinates of x; not finite if the tetrahedron has no volume.
[[nodiscard]] std::array<double, 4> barycentric(const Lattice::Corners& corners,
                                                const Imath::V3d& x);

}  // namespace mapping
