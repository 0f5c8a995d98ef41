#include "levelset/grids/box_mask_vdb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace levelset {

using openvdb::Coord;

void addBox(openvdb::MaskTree& points, const openvdb::CoordBBox& box) {
  const Coord first = box.min() & ~7;
  Coord origin;
  for (origin.x() = first.x(); origin.x() <= box.max().x(); origin.x() += 8)
    for (origin.y() = first.y(); origin.y() <= box.max().y(); origin.y() += 8)
      for (origin.z() = first.z(); origin.z() <= box.max().z(); origin.z() += 8) {
        openvdb::CoordBBox part(origin, origin.offsetBy(7));
        part.intersect(box);
        part.translate(-origin);
        const auto row = static_cast<std::uint64_t>((2 << part.max().z()) - (1 << part.min().z()));
        std::uint64_t slab = 0;
        for (int y = part.min().y(); y <= part.max().y(); ++y) slab |= row << (8 * y);
        auto& mask = points.touchLeaf(origin)->getValueMask();
        for (int x = part.min().x(); x <= part.max().x(); ++x)
          mask.getWord<std::uint64_t>(static_cast<openvdb::Index>(x)) |= slab;
      }
}

void addBall(openvdb::MaskTree& points, const Coord& centre, double radius) {
  const double squared = radius * radius;
  const int reach = static_cast<int>(radius);
  const Coord first = centre.offsetBy(-reach) & ~7, last = centre.offsetBy(reach);
  openvdb::util::NodeMask<3> part;
  Coord origin;
  for (origin.x() = first.x(); origin.x() <= last.x(); origin.x() += 8)
    for (origin.y() = first.y(); origin.y() <= last.y(); origin.y() += 8)
      for (origin.z() = first.z(); origin.z() <= last.z(); origin.z() += 8) {
        // The ball in this leaf, with the centre relative to it.
        const Coord c = centre - origin;
        bool isEmpty = true;
        for (int x = 0; x < 8; ++x) {
          std::uint64_t slab = 0;
          for (int y = 0; y < 8; ++y) {
            const double rest = squared - (x - c.x()) * (x - c.x()) - (y - c.y()) * (y - c.y());
            if (rest < 0) continue;
            const int z = static_cast<int>(std::sqrt(rest));
            const int low = std::max(0, c.z() - z), high = std::min(7, c.z() + z);
            if (low > high) continue;
            slab |= static_cast<std::uint64_t>((2 << high) - (1 << low)) << (8 * y);
          }
          part.getWord<std::uint64_t>(static_cast<openvdb::Index>(x)) = slab;
          isEmpty = isEmpty && slab == 0;
        }
        if (!isEmpty) points.touchLeaf(origin)->getValueMask() |= part;
      }
}

}  // namespace levelset
