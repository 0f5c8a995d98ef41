#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/progress.h"

namespace levelset {

/// Counts the pairs of triangles that cross each other, apart from shared vertices and edges. Uses
/// exact predicates.
[[nodiscard]] std::size_t countSelfIntersections(const TriMesh& mesh,
                                                 const Progress& progress = {});

/// Generalised winding number of the mesh at `point`, by direct summation over all triangles. Tests
/// use it as the reference for the sign of bands.
[[nodiscard]] double windingNumber(const TriMesh& mesh, const Imath::V3d& point);

}  // namespace levelset
