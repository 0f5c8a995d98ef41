#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Solids made from formulas: exact signed distances on both sides, in a band on the axis-aligned
/// grid of integer multiples of the voxel size. Sizes are full extents, world units.
namespace levelset {

struct ShapeOptions {
  double halfWidth = 3;               ///< voxels, at least 1
  Imath::Box3d region = kEverywhere;  ///< world; only there, as cropped() leaves it
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// All throw UsageError for sizes, voxel size or half width that are not positive and finite,
/// InvalidInput when the voxel is larger than the shape, ResourceLimit for memory or 32-bit
/// indices.
[[nodiscard]] NarrowBand makeSphere(double radius, const Imath::V3d& center, double voxelSize,
                                    const ShapeOptions& options = {});
[[nodiscard]] NarrowBand makeBox(const Imath::V3d& size, const Imath::V3d& center, double voxelSize,
                                 const ShapeOptions& options = {});
/// A circle of `radius` about `axis` through `center`, thickened by `tube`.
[[nodiscard]] NarrowBand makeTorus(double radius, double tube, const Imath::V3d& center,
                                   const Imath::V3d& axis, double voxelSize,
                                   const ShapeOptions& options = {});
[[nodiscard]] NarrowBand makeCylinder(double radius, double height, const Imath::V3d& center,
                                      const Imath::V3d& axis, double voxelSize,
                                      const ShapeOptions& options = {});
[[nodiscard]] NarrowBand makeCapsule(const Imath::V3d& from, const Imath::V3d& to, double radius,
                                     double voxelSize, const ShapeOptions& options = {});

/// What is known of a shape before its band is made: its size, and what a band will cost.
struct ShapeExtent {
  Imath::Box3d bounds;  ///< of the surface
  double area = 0;      ///< of the surface; of parts that overlap, their sum
};
[[nodiscard]] ShapeExtent sphereExtent(double radius, const Imath::V3d& center);
[[nodiscard]] ShapeExtent boxExtent(const Imath::V3d& size, const Imath::V3d& center);
/// @param axis  of any length but zero, here and below
[[nodiscard]] ShapeExtent torusExtent(double radius, double tube, const Imath::V3d& center,
                                      const Imath::V3d& axis);
[[nodiscard]] ShapeExtent cylinderExtent(double radius, double height, const Imath::V3d& center,
                                         const Imath::V3d& axis);
[[nodiscard]] ShapeExtent capsuleExtent(const Imath::V3d& from, const Imath::V3d& to,
                                        double radius);

/// Refuses, as making it would, what can be told from the extent of a shape. @param action  its
/// name
void checkShape(const ShapeExtent& extent, double voxelSize, const ShapeOptions& options,
                const char* action);

}  // namespace levelset
