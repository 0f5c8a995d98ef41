#pragma once

#include <Imath/ImathVec.h>

#include <vector>

#include "levelset/mesh.h"

namespace levelset {

/// Computes normals of the vertices of a mesh: sums of the normals of the triangles, weighted by
/// their angles [Baerentzen05]. A vertex on a crease has no single normal. Slivers, with a height
/// below a thousandth of their longest side, do not count.
/// @param creaseAngle  largest angle between the normal and that of a triangle there, radians
/// @return one for each vertex, of length 1; zero on a crease, and where all triangles are
///         slivers
[[nodiscard]] std::vector<Imath::V3d> vertexNormals(const TriMesh& mesh, double creaseAngle);

}  // namespace levelset
