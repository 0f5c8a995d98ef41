#pragma once

#include <Imath/ImathVec.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "apps/viewer/volume/shown_volume.h"
#include "levelset/volumes/volume.h"
#include "render/camera.h"
#include "render/images/image.h"

namespace viewer {

/// A point of a slice through a volume.
struct SlicePoint {
  std::size_t axis = 0;  ///< axis of the grid that the slice is perpendicular to
  Imath::V3d position;   ///< world units
  double depth = 0;      ///< along the view axis, world units
  double value = 0;      ///< trilinear interpolant of the volume
};

/// First point of the slices on the ray through the picture position (x, y), in pixels of the
/// camera. Nothing if the ray misses them.
[[nodiscard]] std::optional<SlicePoint> sliceAt(const levelset::Volume& volume,
                                                const SliceView& slices,
                                                const render::Camera& camera, double x, double y);

/// Normal of the slices across an axis of the grid: the unit vector perpendicular to them that
/// points towards larger indices.
[[nodiscard]] Imath::V3d sliceNormal(const levelset::Volume& volume, std::size_t axis);

/// Paints slices over a picture. A surface in front of a slice hides it as far as the surface is
/// opaque; surfaces behind it are hidden.
/// @param picture  picture of the same view, of any size; its layer Z is the depth of the surfaces
/// @param colours  red, green, blue and alpha of each pixel of the camera, a byte each
void paintSlices(const levelset::Volume& volume, const SliceView& slices,
                 const render::Camera& camera, const render::Image& picture,
                 std::vector<std::uint8_t>& colours);

}  // namespace viewer
