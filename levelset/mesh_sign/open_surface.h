#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "levelset/mesh_sign/sign_field.h"

namespace levelset::convert {

/// Finds the surface where the winding number is 1/2, as far as it spans holes of the mesh instead
/// of following its triangles.
///
/// Starts at the blocks with origins `seeds`: the blocks near the mesh with an ambiguous sign.
/// Follows the grid edges whose ends differ in sign although no triangle lies between them. Returns
/// a dual surface as triangles: each vertex is the mean of the crossings of its cell [Gibson98].
/// Also returns each crossing as a degenerate triangle, so that every sign change has the surface
/// within a voxel.
[[nodiscard]] std::vector<std::array<Imath::V3d, 3>> findOpenSurface(const SignField& field,
                                                                     std::vector<Imath::V3i> seeds,
                                                                     std::size_t maxMemory,
                                                                     const Progress& progress);

}  // namespace levelset::convert
