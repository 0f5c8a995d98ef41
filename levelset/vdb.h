#pragma once

// Access to the OpenVDB grid behind a band. Include it from .cpp files only: OpenVDB's headers take
// three seconds to compile.

#include <openvdb/openvdb.h>

#include "levelset/narrow_band.h"

namespace levelset {

struct VdbGrid {
  openvdb::FloatGrid::Ptr grid;
  /// Null for a solid. An open surface is extended straight beyond its border, so that the band
  /// does not end at the border. The tree is active at grid points whose closest point lies on that
  /// extension. Its value is the distance of that point from the border, in voxels.
  std::shared_ptr<const openvdb::FloatTree> beyond = {};
};

struct VdbAccess {
  static std::shared_ptr<VdbGrid>& slot(NarrowBand& band) { return band.grid_; }
};

/// Returns the grid of a band, read-only.
/// @pre the band is not default constructed
[[nodiscard]] inline const openvdb::FloatGrid& vdb(const NarrowBand& band) {
  return *band.shared()->grid;
}

/// Returns the grid of a band, for editing. Copies the grid first when another band shares it.
[[nodiscard]] openvdb::FloatGrid& editVdb(NarrowBand& band);

/// Takes the grid out of a band that is not used any more. Returns null, and leaves the band as it
/// is, if another band shares the grid. Keep the band as long as its grid is read: without it, the
/// other band would count as the only one, and its grid could be edited.
[[nodiscard]] inline openvdb::FloatGrid::Ptr takeUnshared(NarrowBand& band) {
  std::shared_ptr<VdbGrid>& slot = VdbAccess::slot(band);
  if (slot.use_count() > 1) return nullptr;
  const std::shared_ptr<VdbGrid> own = std::move(slot);
  return std::move(own->grid);
}

/// Makes a band of a grid and sets its class to level set. The grid must fulfil the invariants of a
/// band: background > 0, a transform of rotation, uniform scale and translation, no active tiles,
/// inactive values ± background. Debug builds assert the first two; the others are not checked.
[[nodiscard]] NarrowBand makeBand(openvdb::FloatGrid::Ptr grid);

/// Makes the band of an open surface, as makeBand does.
/// @param beyond  distances from the border, see VdbGrid::beyond; its background is 0
[[nodiscard]] NarrowBand makeOpenBand(openvdb::FloatGrid::Ptr grid,
                                      std::shared_ptr<const openvdb::FloatTree> beyond);

/// Checks the invariants of an external grid and makes a band of it. Splits active tiles into
/// voxels and sets inactive values to ± background by their sign. Writes the numbers of both to
/// `repairs` unless it is null.
/// @throws InvalidInput for NaN or infinite values, a background ≤ 0, a class other than level set,
///         or a transform that is not a rotation, uniform scale and translation
[[nodiscard]] NarrowBand importBand(openvdb::FloatGrid::Ptr grid, BandRepairs* repairs = nullptr);

[[nodiscard]] inline Imath::V3d toImath(const openvdb::Vec3d& v) {
  return {v.x(), v.y(), v.z()};
}
[[nodiscard]] inline openvdb::Vec3d toVdb(const Imath::V3d& v) {
  return {v.x, v.y, v.z};
}

/// Returns the axis-aligned transform world = voxelSize × index.
[[nodiscard]] openvdb::math::Transform::Ptr uniformTransform(double voxelSize);

/// Returns the background of a band: halfWidth × voxelSize, rounded up to a float. Rounding down
/// would turn a half width of 3 voxels into 2.9999999, which OpenVDB's own check refuses. All bands
/// get their background from this function, because equal half widths must give equal bits.
/// NarrowBand::halfWidth() returns a number that gives the same background again.
[[nodiscard]] float backgroundOf(double halfWidth, double voxelSize);

/// Checks that distances up to `background` fit into single precision.
/// @throws InvalidInput when the background overflows `float`, or a thousandth of it underflows
void requireBackground(float background, double voxelSize);

/// Returns the index box of all blocks (8³ grid points) that intersect a world box, clamped to the
/// index range. Its corners are the lowest grid point of the first block and the highest of the
/// last.
[[nodiscard]] openvdb::CoordBBox blocksOf(const Imath::Box3d& world,
                                          const openvdb::math::Transform& transform);

/// Returns an empty level-set grid with the given transform and the background halfWidth ×
/// voxelSize.
/// @throws InvalidInput when the background does not fit into `float`, see requireBackground()
[[nodiscard]] openvdb::FloatGrid::Ptr emptyLevelSet(openvdb::math::Transform::Ptr transform,
                                                    double halfWidth);

}  // namespace levelset
