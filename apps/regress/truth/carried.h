#pragma once

#include <Imath/ImathVec.h>

#include "levelset/fields/field.h"
#include "levelset/narrow_band.h"

namespace regress {

/// Moves a ball by a velocity, as a reference for advection. 256 classical Runge-Kutta steps of
/// fourth order move points of its sphere, which are about a quarter of a voxel apart. The
/// triangles between the moved points become a band by exact distances. The code shares nothing
/// with the advection that is compared with it.
/// @param velocity  smooth; the surface is rounded off where the velocity stretches the points more
/// than a voxel or two apart
/// @param time      duration of the motion, which starts at time 0
[[nodiscard]] levelset::NarrowBand carriedBall(const Imath::V3d& centre, double radius,
                                               const levelset::VectorField& velocity, double time,
                                               double voxelSize);

}  // namespace regress
