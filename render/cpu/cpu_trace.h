#pragma once

#include <vector>

#include "render/bricks/brick_pool.h"
#include "render/kernel/ray_block.h"
#include "render/kernel/ray_fan.h"

namespace render {

enum class InstructionSet { Sse2, Avx2, Avx512 };

/// Instruction sets that this processor supports, the fastest last.
[[nodiscard]] std::vector<InstructionSet> instructionSets();

/// Finds the first crossing of each ray with a band's zero set. All instruction sets return the
/// same bits.
/// @param hits  must have as many entries as `rays`
/// @pre the processor supports the set
void traceRays(const BrickPool& pool, const RayBlock& rays, HitBlock& hits,
               InstructionSet set = instructionSets().back());

/// Finds the first crossing of each ray, and the shape of the surface there.
/// @param hits, shapes  must have as many entries as `rays`
/// @pre the processor supports the set
void traceRays(const BrickPool& pool, const RayBlock& rays, HitBlock& hits, ShapeBlock& shapes,
               InstructionSet set = instructionSets().back());

/// Finds the first crossing of the ray through each pixel, and the shape of the surface at the
/// crossing. It is fastest when neighbouring pixels follow each other.
/// @param hits, shapes  must have as many entries as `pixels`
/// @pre the processor supports the set
void tracePixels(const BrickPool& pool, const RayFan& fan, const PixelBlock& pixels, HitBlock& hits,
                 ShapeBlock& shapes, InstructionSet set = instructionSets().back());

}  // namespace render
