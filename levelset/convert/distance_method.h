#pragma once

namespace levelset {

/// Algorithm that computes the distances of grid points from the triangles of a mesh. Both compute
/// the same distances.
enum class DistanceMethod {
  Blocks,  ///< for each block of grid points, excludes triangles by bounding spheres
  Prisms   ///< scan conversion of a prism around each triangle [Sigg06, 4.2.3]
};

}  // namespace levelset
