#pragma once

#include <Imath/ImathVec.h>

#include "levelset/fields/field.h"
#include "levelset/narrow_band.h"

namespace regress {

/// A ball where a velocity has taken it, without any level set on the way: points of its sphere,
/// four to a voxel, are carried by 256 classical Runge-Kutta steps of fourth order, and the
/// triangles between them become a band by exact distances. Of its own, since what it judges must
/// not take part.
/// @param velocity  smooth; one that stretches the points further apart than a voxel or two leaves
///                  the surface rounded off there
/// @param time      from 0
[[nodiscard]] levelset::NarrowBand carriedBall(const Imath::V3d& centre, double radius,
                                               const levelset::VectorField& velocity, double time,
                                               double voxelSize);

}  // namespace regress
