#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <optional>

#include "levelset/narrow_band.h"
#include "render/camera.h"

namespace viewer {

/// A point of a solid's zero set that a ray meets.
struct SurfaceHit {
  Imath::V3d position, normal;  ///< world units; outward unit normal
};

/// First point at which a ray enters a solid: φ = 0 of the trilinear interpolant, to rounding.
/// Unlike a pick in a picture, it depends neither on the picture's resolution nor on what the
/// picture shows. A ray that starts inside the solid first leaves it. Steps have the length of φ,
/// so walls thinner than a tenth of a voxel may be missed.
/// @param bounds  box of the zero set, world units, not empty
[[nodiscard]] std::optional<SurfaceHit> surfaceUnder(const levelset::NarrowBand& band,
                                                     const Imath::Box3d& bounds,
                                                     const render::Camera::Ray& ray);

}  // namespace viewer
