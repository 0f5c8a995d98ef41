#pragma once

// Internal header of levelset: public headers must not include it.

#include <Imath/ImathVec.h>

#include <cstdint>

#include "levelset/adaptive/octree/adaptive_tree.h"

namespace levelset {

/// Calls visit(world position) where the zero set crosses an edge of a leaf, by linear
/// interpolation. Visits a crossing from each leaf that has the edge.
template <class Visit>
void forEachEdgeCrossing(const AdaptiveTree& tree, const Visit& visit) {
  const HashedOctree& octree = tree.octree;
  for (std::uint32_t b = 0; b < octree.blockCount(); ++b) {
    const CellKey parent = octree.parent(b);
    for (int octant = 0; octant < 8; ++octant) {
      const CellKey leaf = parent.child(octant);
      if (octree.isSplit(leaf)) continue;
      for (int c = 0; c < 8; ++c)
        for (int axis = 0; axis < 3; ++axis) {
          if (c >> axis & 1) continue;
          const double v = tree.corner(b, octant, c), w = tree.corner(b, octant, c | 1 << axis);
          if ((v < 0) == (w < 0)) continue;
          Imath::V3d at =
              Imath::V3d(leaf.low()) + Imath::V3d(c & 1, c >> 1 & 1, c >> 2) * leaf.edge();
          at[axis] += leaf.edge() * (v / (v - w));
          visit(tree.origin + at * tree.unit);
        }
    }
  }
}

}  // namespace levelset
