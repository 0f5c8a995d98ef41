#pragma once

// The one header that includes OpenVDB. Include it from .cpp files only: it costs three seconds.

#include <openvdb/openvdb.h>

#include "levelset/narrow_band.h"

namespace levelset {

struct VdbGrid {
  openvdb::FloatGrid::Ptr grid;
  /// Of an open surface: how far beyond the border the closest point of what it goes on by lies,
  /// voxels; active where it goes on.
  std::shared_ptr<const openvdb::FloatTree> beyond = {};
};

struct VdbAccess {
  static std::shared_ptr<VdbGrid>& slot(NarrowBand& band) { return band.grid_; }
};

/// The grid behind a band, to read. @pre the band was made, not default constructed
[[nodiscard]] inline const openvdb::FloatGrid& vdb(const NarrowBand& band) {
  return *band.shared()->grid;
}

/// The grid behind a band, to change: copied first if somebody else holds it.
[[nodiscard]] openvdb::FloatGrid& editVdb(NarrowBand& band);

/// Takes a grid that holds the invariants of a band (asserted in debug builds, not checked):
/// class level set, background > 0, no active tiles, inactive values ± background.
[[nodiscard]] NarrowBand makeBand(openvdb::FloatGrid::Ptr grid);

/// As makeBand, of an open surface.
/// @param beyond  as in VdbGrid; background 0
[[nodiscard]] NarrowBand makeOpenBand(openvdb::FloatGrid::Ptr grid,
                                      std::shared_ptr<const openvdb::FloatTree> beyond);

/// Checks the invariants of a grid that came from outside and takes it.
/// Active tiles are voxelised, inactive values are set to ± background by their sign; `repairs`,
/// if given, counts them.
/// @throws InvalidInput for NaN or infinite values, a background ≤ 0, a class other than level set,
///         or a transform that is not a rotation, uniform scale and translation
[[nodiscard]] NarrowBand importBand(openvdb::FloatGrid::Ptr grid, const char* action,
                                    BandRepairs* repairs = nullptr);

[[nodiscard]] inline Imath::V3d toImath(const openvdb::Vec3d& v) {
  return {v.x(), v.y(), v.z()};
}
[[nodiscard]] inline openvdb::Vec3d toVdb(const Imath::V3d& v) {
  return {v.x, v.y, v.z};
}

/// An axis-aligned transform: world = voxelSize × index.
[[nodiscard]] openvdb::math::Transform::Ptr uniformTransform(double voxelSize);

/// halfWidth × voxelSize, rounded up: a band of three voxels must not become one of 2.9999999,
/// which OpenVDB's own check refuses. Bands must agree to the bit in where they end, so that
/// everybody takes it from here; `NarrowBand::halfWidth` gives back what makes the same number
/// again.
[[nodiscard]] float backgroundOf(double halfWidth, double voxelSize);

/// @throws InvalidInput when distances up to there leave the range of `float`
void requireBackground(float background, double voxelSize, const char* action);

/// The 8³ blocks of grid points that meet a world box, as far as there are indices: from the first
/// point of the first to the last of the last.
[[nodiscard]] openvdb::CoordBBox blocksOf(const Imath::Box3d& world,
                                          const openvdb::math::Transform& transform);

/// An empty level-set grid with that transform and background halfWidth × voxelSize.
[[nodiscard]] openvdb::FloatGrid::Ptr emptyLevelSet(openvdb::math::Transform::Ptr transform,
                                                    double halfWidth);

}  // namespace levelset
