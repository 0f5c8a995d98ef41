#pragma once

#include <span>

#include "levelset/mesh_sign/local_mesh.h"
#include "levelset/mesh_sign/self_intersections.h"
#include "levelset/progress.h"

namespace levelset::convert {

/// The part of a mesh without boundary that has the solid on one side and not on the other: where
/// shells overlap, or one lies in another of the same orientation, the sheets inside separate
/// nothing. Triangles that cross others are cut along them. Folds shallower than a quarter voxel
/// stay.
/// @param pairs the triangles that meet, as findSelfIntersections gives them
/// @param flip  −1 when the mesh faces inwards and is taken to be turned
[[nodiscard]] LocalMesh separatingSurface(const LocalMesh& mesh,
                                          std::span<const TrianglePair> pairs, double flip,
                                          const Progress& progress);

}  // namespace levelset::convert
