#pragma once

#include <Imath/ImathVec.h>

#include "levelset/fields/field.h"
#include "levelset/narrow_band.h"

namespace regress {

/// Ball moved by a velocity without a level set between. 256 classical Runge-Kutta steps of fourth
/// order move points of its sphere, four to a voxel. The triangles between the points become a band
/// by exact distances. The code shares nothing with the advection that it judges.
/// @param velocity  smooth; the surface is rounded off where the velocity stretches the points more
/// than a voxel or two apart
/// @param time      from 0
[[nodiscard]] levelset::NarrowBand carriedBall(const Imath::V3d& centre, double radius,
                                               const levelset::VectorField& velocity, double time,
                                               double voxelSize);

}  // namespace regress
