#pragma once

#include <cstddef>
#include <utility>

#include "render/kernel/kernel_scene.h"

namespace render {

/// Moves a hit of the kernel to its ray in double precision.
///
/// The hit lies on the surface within roundings of 1e-7 of the values in its cell. But it lies up
/// to 1e-5 voxel beside the ray, because origin, direction and parameter of the ray are rounded. So
/// the ray is intersected with the tangent plane of the surface at the hit. If the ray is nearly
/// parallel to the surface, both roundings grow. Then the zero is found by secants of the field in
/// double precision.
/// @param ray  origin and direction of ray n in double precision, table space
/// @param hits  what the kernel found
/// @param shapes  the gradients of hit n are moved to the new position by the Hessian
/// @param n  index of a hit
/// @return parameter of the ray; that of `hits` where no better one is found
[[nodiscard]] double refineHit(const KernelSolid& solid,
                               const std::pair<Imath::V3d, Imath::V3d>& ray, std::size_t n,
                               const HitBlock& hits, ShapeBlock& shapes);

}  // namespace render
