#pragma once

// Internal header of levelset: public headers must not include it.

#include <cstdint>
#include <vector>

#include "levelset/meshing/cells/cell_surface.h"

namespace levelset {

/// Vertex that halves a side of triangles.
struct SideMiddle {
  std::uint32_t low, high;  ///< vertices at the ends of the side, in ascending order
  openvdb::Vec3d position;
};

/// Divides triangles at middles of their sides. A triangle with three middles becomes four; one
/// with fewer becomes a fan. The middles follow the vertices of the mesh, in their order.
/// @param middles  in ascending order of `low` and `high`
[[nodiscard]] IndexMesh divideSides(const IndexMesh& mesh, const std::vector<SideMiddle>& middles);

}  // namespace levelset
