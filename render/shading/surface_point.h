#pragma once

#include "levelset/narrow_band.h"
#include "render/hit.h"

namespace render {

/// Fills in the normals of a hit at its position, and how far the surface may be off.
/// @param direction  of the ray: what faces it is the normal where φ has no gradient
void addNormals(Hit& hit, const levelset::NarrowBand& band, const Imath::V3d& direction);

/// At a point of a band's surface, from the Hessian of the tricubic B-spline.
[[nodiscard]] CurvatureSample curvatureAt(const levelset::NarrowBand& band,
                                          const Imath::V3d& world);

}  // namespace render
