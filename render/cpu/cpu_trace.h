#pragma once

#include <vector>

#include "render/bricks/brick_pool.h"
#include "render/kernel/ray_block.h"
#include "render/kernel/ray_fan.h"

namespace render {

enum class InstructionSet { Sse2, Avx2, Avx512 };

/// Those that this processor has, the fastest last.
[[nodiscard]] std::vector<InstructionSet> instructionSets();

/// First crossings of rays with a band's zero set; the bits are the same on all instruction sets.
/// @param hits  as long as the rays
/// @pre the processor has the set
void traceRays(const BrickPool& pool, const RayBlock& rays, HitBlock& hits,
               InstructionSet set = instructionSets().back());

/// The same of pixels of a fan, and what the surface is like there; packets of neighbours are the
/// fastest.
/// @param hits, shapes  as long as the pixels
void tracePixels(const BrickPool& pool, const RayFan& fan, const PixelBlock& pixels, HitBlock& hits,
                 ShapeBlock& shapes, InstructionSet set = instructionSets().back());

}  // namespace render
