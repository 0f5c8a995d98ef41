#pragma once

#include <Imath/ImathVec.h>

#include "tests/support/formula_patches.h"
#include "tests/support/patches.h"

/// Bases for patches with many layers.
namespace support {

/// Slab with its upper side at z = top, about the origin.
inline levelset::NarrowBand makeSlab(double half, double voxel, double top = 0) {
  return sampleBand([=](const Imath::V3d& p) { return p.z - top; },
                    {Imath::V3d(-half, -half, top), Imath::V3d(half, half, top)}, voxel);
}

}  // namespace support
