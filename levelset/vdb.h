#pragma once

// The only header that includes OpenVDB. Include it from .cpp files only: it takes three seconds to
// compile.

#include <openvdb/openvdb.h>

#include "levelset/narrow_band.h"

namespace levelset {

struct VdbGrid {
  openvdb::FloatGrid::Ptr grid;
  /// For an open surface: distance beyond the border, in voxels, of the closest point on the
  /// surface's straight extension. Active where the band belongs to the extension.
  std::shared_ptr<const openvdb::FloatTree> beyond = {};
};

struct VdbAccess {
  static std::shared_ptr<VdbGrid>& slot(NarrowBand& band) { return band.grid_; }
};

/// The grid behind a band, read-only. @pre the band is not default constructed
[[nodiscard]] inline const openvdb::FloatGrid& vdb(const NarrowBand& band) {
  return *band.shared()->grid;
}

/// The grid behind a band, for editing. Copies it first when another band shares it.
[[nodiscard]] openvdb::FloatGrid& editVdb(NarrowBand& band);

/// Makes a band of a grid that fulfils the invariants of a band: class level set, background > 0,
/// no active tiles, inactive values ± background. Debug builds assert them; nothing else checks
/// them.
[[nodiscard]] NarrowBand makeBand(openvdb::FloatGrid::Ptr grid);

/// Makes the band of an open surface, as makeBand does.
/// @param beyond  as in VdbGrid, with background 0
[[nodiscard]] NarrowBand makeOpenBand(openvdb::FloatGrid::Ptr grid,
                                      std::shared_ptr<const openvdb::FloatTree> beyond);

/// Checks the invariants of an external grid and makes a band of it. Splits active tiles into
/// voxels and sets inactive values to ± background by their sign. Counts both in `repairs` if
/// given.
/// @throws InvalidInput for NaN or infinite values, a background ≤ 0, a class other than level set,
///         or a transform that is not a rotation, uniform scale and translation
[[nodiscard]] NarrowBand importBand(openvdb::FloatGrid::Ptr grid, BandRepairs* repairs = nullptr);

[[nodiscard]] inline Imath::V3d toImath(const openvdb::Vec3d& v) {
  return {v.x(), v.y(), v.z()};
}
[[nodiscard]] inline openvdb::Vec3d toVdb(const Imath::V3d& v) {
  return {v.x, v.y, v.z};
}

/// Axis-aligned transform: world = voxelSize × index.
[[nodiscard]] openvdb::math::Transform::Ptr uniformTransform(double voxelSize);

/// halfWidth × voxelSize, rounded up. Rounding down would turn a band of 3 voxels into one of
/// 2.9999999, which OpenVDB's own check refuses. All bands take their background from here, because
/// their widths must agree to the bit. `NarrowBand::halfWidth` returns a number that gives the same
/// background again.
[[nodiscard]] float backgroundOf(double halfWidth, double voxelSize);

/// Checks that distances up to `background` fit into single precision.
/// @throws InvalidInput when they leave the range of `float`
void requireBackground(float background, double voxelSize);

/// Index box of the 8³ blocks of grid points that meet a world box, clamped to the index range. It
/// runs from the lowest point of the first block to the highest point of the last.
[[nodiscard]] openvdb::CoordBBox blocksOf(const Imath::Box3d& world,
                                          const openvdb::math::Transform& transform);

/// Empty level-set grid with that transform and the background halfWidth × voxelSize.
[[nodiscard]] openvdb::FloatGrid::Ptr emptyLevelSet(openvdb::math::Transform::Ptr transform,
                                                    double halfWidth);

}  // namespace levelset
