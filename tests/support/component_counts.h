#pragma once

#include <Imath/ImathVec.h>

#include "tests/support/formula_patches.h"
#include "tests/support/patches.h"

/// What shells of particles stand on.
namespace support {

/// A slab whose upper side is z = top, about the origin.
inline levelset::NarrowBand makeSlab(double half, double voxel, double top = 0) {
  return sampleBand([=](const Imath::V3d& p) { return p.z - top; },
                    {Imath::V3d(-half, -half, top), Imath::V3d(half, half, top)}, voxel);
}

}  // namespace support
