#pragma once

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <functional>
#include <vector>

#include "mapping/maps/lattice.h"

namespace mapping {

/// Hierarchy of bounding boxes over the cells of a lattice. It halves the index ranges of the
/// lattice.
class CellTree {
 public:
  using Cell = std::array<int, 3>;
  explicit CellTree(const Lattice& lattice);
  /// Longest side of the bounding box of all cells, world units.
  [[nodiscard]] double size() const {
    const Imath::V3d sides = nodes_.front().box.size();
    return std::max({sides.x, sides.y, sides.z});
  }

  /// Visits the cells whose world boxes touch `box`, in a fixed order, until `visit` returns true.
  /// @return true if a visit returned true
  bool visit(const Imath::Box3d& box, const std::function<bool(const Cell&)>& visit) const;

 private:
  struct Node {
    Imath::Box3d box;
    Cell from, to;  ///< range of cell indices along u, v, w; `to` is exclusive
    /// Index of the second child; the first child is the next node; 0: a single cell.
    std::size_t second = 0;
  };
  Imath::Box3d build(const Lattice& lattice, const Cell& from, const Cell& to);
  bool visit(std::size_t node, const Imath::Box3d& box,
             const std::function<bool(const Cell&)>& visit) const;

  std::vector<Node> nodes_;
};

}  // namespace mapping
