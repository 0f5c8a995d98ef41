#pragma once

#include <Imath/ImathVec.h>

/// Signs of determinants of double coordinates. They are exact for any finite input that neither
/// overflows nor underflows. A rounded evaluation comes first; where its error bound does not
/// decide, expansion arithmetic follows [Shewchuk97].
namespace levelset::convert {

/// Sign of (a − c) × (b − c) in the plane: +1 when a, b, c turn left, −1 right, 0 collinear.
[[nodiscard]] int orient2d(const Imath::V2d& a, const Imath::V2d& b, const Imath::V2d& c);

/// Sign of (b − a) × (c − a) · (d − a): +1 when d is in front of triangle a, b, c, −1 behind
/// it, 0 in its plane. The corners run counter-clockwise as seen from the front.
[[nodiscard]] int orient3d(const Imath::V3d& a, const Imath::V3d& b, const Imath::V3d& c,
                           const Imath::V3d& d);

}  // namespace levelset::convert
