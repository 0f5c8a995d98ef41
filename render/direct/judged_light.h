#pragma once

#include "render/direct/direct_volume.h"

namespace render {

/// The judge of DirectVolume::light(): the same integral by small steps with the value at their
/// middle. Steps end at the faces of the cells, and are halved where a point of the transfer
/// function lies between the values at their ends. The judge shares neither the traversal nor the
/// closed forms, skips no blocks, and does not end early. The error falls with the square of the
/// steps.
/// @param origin, direction  of the ray, world space; unit length
/// @param near, far  part of the ray, distances in world units; `far` may be infinite
/// @param shading  null: colours do not depend on the gradient
/// @param steps  number of steps in each cell, before they are halved
[[nodiscard]] VolumeLight judgedLight(const DirectVolume& volume, const Imath::V3d& origin,
                                      const Imath::V3d& direction, double near, double far,
                                      const VolumeShading* shading = nullptr, int steps = 32);

}  // namespace render
