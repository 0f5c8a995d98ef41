#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <vector>

#include "mapping/patches/patch.h"

namespace mapping {

/// How far a lattice reaches beyond the unit cube of a patch, so that a texture's band ends in it.
struct LatticeBorder {
  double embedDepth =
      0;           ///< how far the texture lies below w = 0, or above w = 1 if negative; in w
  double rim = 0;  ///< beyond all that, on all six sides, world units; 0: none, nor around
};

/// One of the six tetrahedra of a cell [Brodersen07 §9]. A prism over each half of the cell's
/// bottom, each split by its lowest and highest corner, makes the paths from the cell's first
/// corner to its last: along three axes in one of six orders. So neighbours need not be stored.
struct Tetrahedron {
  std::array<int, 3> cell{};
  int order = 0;  ///< 0 … 5, see Lattice::kOrders
};

/// The particles of a patch as a grid of nodes with the same counts on every layer, split into
/// tetrahedra, with layers around it that go on straight.
class Lattice {
 public:
  /// Axes (u = 0, v = 1, w = 2) in the order in which a tetrahedron's path takes them.
  static constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {0, 2, 1}, {2, 0, 1}, {1, 0, 2}, {1, 2, 0}, {2, 1, 0}}};
  using Corners = std::array<Imath::V3d, 4>;

  /// Layers of fewer particles are refined on a smooth surface through them.
  /// @param border  beyond the layers and sides cells go straight on; around, by one cell at least
  Lattice(const Patch& patch, const LatticeBorder& border);

  [[nodiscard]] const std::array<int, 3>& cells() const { return cells_; }
  [[nodiscard]] std::size_t cellCount() const;
  [[nodiscard]] std::size_t nodeCount() const { return positions_.size(); }

  /// World positions of a tetrahedron's corners, along its path.
  [[nodiscard]] Corners corners(const Tetrahedron& t) const;
  /// Texture coordinates of the same.
  [[nodiscard]] Corners textureCorners(const Tetrahedron& t) const;
  /// Texture coordinates of a cell's box.
  [[nodiscard]] Imath::Box3d textureBox(const std::array<int, 3>& cell) const;
  /// World box of a cell.
  [[nodiscard]] Imath::Box3d worldBox(const std::array<int, 3>& cell) const;
  /// Does a face of the cell lie on the outside of the lattice?
  [[nodiscard]] bool isOutermost(const std::array<int, 3>& cell) const;

  /// Steps through the face opposite a corner. False at the outside.
  [[nodiscard]] bool cross(Tetrahedron& t, int corner) const;

  /// The tetrahedron that holds a place of texture space. False outside the lattice.
  [[nodiscard]] bool locate(const Imath::V3d& uvw, Tetrahedron& t) const;

 private:
  [[nodiscard]] std::size_t nodeIndex(const std::array<int, 3>& node) const {
    const auto at = [](int i) { return static_cast<std::size_t>(i); };
    return (at(node[2]) * at(cells_[1] + 1) + at(node[1])) * at(cells_[0] + 1) + at(node[0]);
  }
  [[nodiscard]] Imath::V3d textureOf(const std::array<int, 3>& node) const {
    return {coordinates_[0][static_cast<std::size_t>(node[0])],
            coordinates_[1][static_cast<std::size_t>(node[1])],
            coordinates_[2][static_cast<std::size_t>(node[2])]};
  }

  std::array<int, 3> cells_{};                      ///< along u, v, w
  std::array<std::vector<double>, 3> coordinates_;  ///< of the nodes, along u, v, w
  std::vector<Imath::V3d> positions_;
};

/// Barycentric coordinates of x; not finite where the tetrahedron has no volume.
[[nodiscard]] std::array<double, 4> barycentric(const Lattice::Corners& corners,
                                                const Imath::V3d& x);

}  // namespace mapping
