#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/progress.h"

namespace levelset {

/// Pairs of triangles that cross each other, shared vertices and edges apart. Exact predicates.
[[nodiscard]] std::size_t countSelfIntersections(const TriMesh& mesh,
                                                 const Progress& progress = {});

/// Generalised winding number of the mesh about `point`, by direct summation: the reference.
[[nodiscard]] double windingNumber(const TriMesh& mesh, const Imath::V3d& point);

}  // namespace levelset
