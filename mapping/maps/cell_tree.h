#pragma once

#include <Imath/ImathBox.h>

#include <algorithm>
#include <array>
#include <functional>
#include <vector>

#include "mapping/maps/lattice.h"

namespace mapping {

/// Boxes around ever smaller parts of a lattice: its own order makes the hierarchy.
class CellTree {
 public:
  using Cell = std::array<int, 3>;
  explicit CellTree(const Lattice& lattice);
  /// The longest side of the box around all, world units.
  [[nodiscard]] double size() const {
    const Imath::V3d sides = nodes_.front().box.size();
    return std::max({sides.x, sides.y, sides.z});
  }

  /// Visits cells whose world boxes touch a box, in one order, until `visit` returns true.
  /// @return whether it did
  bool visit(const Imath::Box3d& box, const std::function<bool(const Cell&)>& visit) const;

 private:
  struct Node {
    Imath::Box3d box;
    Cell from, to;           ///< cells, `to` beyond the last
    std::size_t second = 0;  ///< of two children, the first follows; 0: a single cell
  };
  Imath::Box3d build(const Lattice& lattice, const Cell& from, const Cell& to);
  bool visit(std::size_t node, const Imath::Box3d& box,
             const std::function<bool(const Cell&)>& visit) const;

  std::vector<Node> nodes_;
};

}  // namespace mapping
