#pragma once

#include <span>

#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/mesh_sign/self_intersections.h"
#include "levelset/progress.h"

namespace levelset::convert {

/// Finds the part of a mesh without boundary that separates the solid from the outside. Where
/// surface components overlap, or one lies inside another of the same orientation, the inner sheets
/// separate nothing and are removed. Triangles that cross others are cut along the intersections.
/// Inner sheets within a quarter voxel of the separating surface stay.
/// @param pairs  intersecting triangles, from findSelfIntersections
/// @param flip   −1 when the mesh faces inwards and counts as reversed, else 1
[[nodiscard]] LocalMesh separatingSurface(const LocalMesh& mesh,
                                          std::span<const TrianglePair> pairs, double flip,
                                          const Progress& progress);

}  // namespace levelset::convert
