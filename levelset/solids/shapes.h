#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Solids from formulas, with exact signed distances on both sides. Grid points are at integer
/// multiples of the voxel size. Sizes are full extents in world units.
namespace levelset {

struct ShapeOptions {
  double halfWidth = 3;               ///< half width of the band, voxels, at least 1
  Imath::Box3d region = kEverywhere;  ///< world box; the band is cropped() to it
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

// Errors of all functions:
// @throws UsageError if a size, the voxel size or the half width is not positive and finite
// @throws InvalidInput if the voxel is larger than the shape
// @throws ResourceLimit if the memory estimate or the 32-bit grid index exceeds its limit

/// Builds a ball.
[[nodiscard]] NarrowBand makeSphere(double radius, const Imath::V3d& center, double voxelSize,
                                    const ShapeOptions& options = {});
/// Builds an axis-aligned box. @param size  full edge lengths
[[nodiscard]] NarrowBand makeBox(const Imath::V3d& size, const Imath::V3d& center, double voxelSize,
                                 const ShapeOptions& options = {});
/// Builds a torus: all points within `tube` of a circle of `radius` around the axis.
/// @param axis  direction of the axis through `center`, any length but zero
[[nodiscard]] NarrowBand makeTorus(double radius, double tube, const Imath::V3d& center,
                                   const Imath::V3d& axis, double voxelSize,
                                   const ShapeOptions& options = {});
/// Builds a cylinder of full height `height`, centred at `center`.
[[nodiscard]] NarrowBand makeCylinder(double radius, double height, const Imath::V3d& center,
                                      const Imath::V3d& axis, double voxelSize,
                                      const ShapeOptions& options = {});
/// Builds a capsule: all points within `radius` of a line segment.
[[nodiscard]] NarrowBand makeCapsule(const Imath::V3d& from, const Imath::V3d& to, double radius,
                                     double voxelSize, const ShapeOptions& options = {});

/// Extent of a shape, known before its band is built. It determines the memory of the band.
struct ShapeExtent {
  Imath::Box3d bounds;  ///< bounds of the surface, world units
  double area = 0;      ///< surface area, world units²; sum over parts that overlap
};
[[nodiscard]] ShapeExtent sphereExtent(double radius, const Imath::V3d& center);
[[nodiscard]] ShapeExtent boxExtent(const Imath::V3d& size, const Imath::V3d& center);
/// @param axis  any length but zero, also for cylinderExtent()
[[nodiscard]] ShapeExtent torusExtent(double radius, double tube, const Imath::V3d& center,
                                      const Imath::V3d& axis);
[[nodiscard]] ShapeExtent cylinderExtent(double radius, double height, const Imath::V3d& center,
                                         const Imath::V3d& axis);
[[nodiscard]] ShapeExtent capsuleExtent(const Imath::V3d& from, const Imath::V3d& to,
                                        double radius);

/// Checks the voxel size, half width and memory of a shape from its extent. Throws the same errors
/// as building the shape.
/// @param action  name of the shape, for messages
void checkShape(const ShapeExtent& extent, double voxelSize, const ShapeOptions& options,
                const char* action);

}  // namespace levelset
