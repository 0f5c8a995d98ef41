#include "levelset/grids/box_mask_vdb.h"

#include <cmath>

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
  for (int x = -reach; x <= reach; ++x)
    for (int y = -reach; y <= reach; ++y) {
      const double rest = squared - x * x - y * y;
      if (rest < 0) continue;
      const int z = static_cast<int>(std::sqrt(rest));
      addBox(points, {centre.offsetBy(x, y, -z), centre.offsetBy(x, y, z)});
    }
}

}  // namespace levelset
