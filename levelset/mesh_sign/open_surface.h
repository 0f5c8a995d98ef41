#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "levelset/mesh_sign/sign_field.h"

namespace levelset::convert {

/// Where a mesh has holes, the surface w = 1/2 leaves the triangles and spans them. Follows it from
/// the blocks `seeds` (those near the mesh whose sign is not clear) through the grid edges that
/// change sign without a face in between, and returns it as triangles: a dual surface, its vertices
/// at the mean of the crossings of their cell [Gibson98], and each crossing itself as a triangle
/// without extent, so that every change of sign has the surface within a voxel.
[[nodiscard]] std::vector<std::array<Imath::V3d, 3>> findOpenSurface(const SignField& field,
                                                                     std::vector<Imath::V3i> seeds,
                                                                     std::size_t maxMemory,
                                                                     const Progress& progress);

}  // namespace levelset::convert
