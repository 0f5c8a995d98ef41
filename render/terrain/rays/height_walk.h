#pragma once

// Private to the ray casting of height fields.

#include "render/terrain/rays/terrain_tables.h"

namespace render {

/// Finds the nearest intersection of a ray, with the bits of HeightKernel::walkHeights(). It tests
/// 16 nodes of the pyramid at a time.
/// @param isAny  the walk ends at the first intersection that is found
/// @param isWide  uses AVX2, which the processor must have (hasWideHeights())
[[nodiscard]] HeightKernel::HeightWalk walkGround(const TerrainTables& tables,
                                                  const HeightKernel::HeightRay& ray, bool isAny,
                                                  bool isWide);

/// Returns true if the processor has AVX2.
[[nodiscard]] bool hasWideHeights();

}  // namespace render
