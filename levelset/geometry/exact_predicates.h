#pragma once

#include <Imath/ImathVec.h>

/// Signs of determinants of double coordinates, exact for any finite input that neither overflows
/// nor underflows: a rounded evaluation with its error bound, and expansion arithmetic where the
/// bound does not decide [Shewchuk97].
namespace levelset::convert {

/// Sign of (a − c) × (b − c) in the plane: +1 when a, b, c turn left, −1 right, 0 collinear.
[[nodiscard]] int orient2d(const Imath::V2d& a, const Imath::V2d& b, const Imath::V2d& c);

/// Sign of (b − a) × (c − a) · (d − a): +1 when d lies on the side to which the triangle a, b, c
/// (counter-clockwise) shows its front, −1 behind it, 0 in its plane.
[[nodiscard]] int orient3d(const Imath::V3d& a, const Imath::V3d& b, const Imath::V3d& c,
                           const Imath::V3d& d);

}  // namespace levelset::convert
