#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <memory>
#include <utility>
#include <vector>

#include "levelset/progress.h"
#include "levelset/volumes/block_ranges.h"
#include "levelset/volumes/volume.h"
#include "render/filter.h"

namespace render {

enum class VolumeInside {
  Above,  ///< points with values above the isovalue are inside
  Below   ///< points with values below the isovalue are inside
};

/// Isosurface of a volume that renderers draw: zero set of the field f = isovalue − value (for
/// VolumeInside::Below: value − isovalue), interpolated by a filter. As in a level set, f is
/// negative inside, and a point with f = 0 is outside. The surface is open where it meets the
/// border of the volume.
///
/// Samples of f are rounded to single precision. Beyond the border the values continue by
/// GridExtension::Quadratic, for at most kReach grid points.
///
/// The class has value semantics. Copies share the numbers and the ranges of the volume.
class VolumeSurface {
 public:
  static constexpr int kReach = levelset::BlockRanges::kReach;

  /// Finds the ranges of the blocks of the volume.
  /// @throws UsageError for an isovalue that is NaN or infinite
  /// @throws InvalidInput for values above 1e30
  /// @throws Cancelled
  VolumeSurface(levelset::Volume volume, double isovalue, VolumeInside inside = VolumeInside::Above,
                const levelset::Progress& progress = {});

  /// The surface of another isovalue of the same volume, which needs no further pass over its
  /// values.
  /// @throws UsageError for an isovalue that is NaN or infinite
  [[nodiscard]] VolumeSurface withIsovalue(double isovalue) const {
    return withIsovalue(isovalue, inside_);
  }
  [[nodiscard]] VolumeSurface withIsovalue(double isovalue, VolumeInside inside) const;

  [[nodiscard]] const levelset::Volume& volume() const { return *volume_; }
  /// Ranges of the blocks of the volume, shared by all isosurfaces of it.
  [[nodiscard]] const levelset::BlockRanges& ranges() const { return *ranges_; }
  [[nodiscard]] double isovalue() const { return isovalue_; }
  [[nodiscard]] VolumeInside inside() const { return inside_; }
  /// Any invertible affine map.
  [[nodiscard]] const Imath::M44d& indexToWorld() const { return volume_->grid().indexToWorld; }
  /// Largest distance between neighbouring grid points along an axis, world units.
  [[nodiscard]] double voxelSize() const;
  /// Returns true when no grid point or every grid point is inside, or the grid has no cells.
  [[nodiscard]] bool isEmpty() const;
  /// Returns true when the surface of a filter is certainly empty. Unlike the trilinear
  /// interpolant, other filters also have values beyond those of the grid points. @see blocks()
  [[nodiscard]] bool isEmpty(Filter filter) const;
  /// Blocks of 8³ cells that may hold a crossed cell, by their lowest grid points, ordered by x, y,
  /// z.
  [[nodiscard]] std::vector<Imath::V3i> blocks(Filter filter) const;
  /// Range of the cells in which the surface is drawn, both ends included. Filters on tetrahedra
  /// have a cell around each grid point, and draw those with all 27 data in the volume.
  [[nodiscard]] std::pair<Imath::V3i, Imath::V3i> cells(Filter filter) const {
    const int first = tetrahedralDegree(filter) > 0 ? 1 : 0;
    return {Imath::V3i(first), volume_->size() - Imath::V3i(2)};
  }
  /// f at a value of the volume.
  [[nodiscard]] float field(double value) const {
    return static_cast<float>(inside_ == VolumeInside::Above ? isovalue_ - value
                                                             : value - isovalue_);
  }
  /// Copies f at a box of grid points, ordered by x, y, z. Points more than kReach beyond the
  /// border become 0. @param out  as many numbers as the box has points
  void copyField(const Imath::V3i& low, const Imath::V3i& size, float* out) const;
  /// Bounds of the surface, world units: box of all sign changes of f between neighbouring grid
  /// points, located by linear interpolation. Empty when there are none.
  [[nodiscard]] Imath::Box3d bounds() const;
  /// Extents of the same points in several directions, as NarrowBand::zeroSetExtents().
  [[nodiscard]] std::vector<double> extents(const std::vector<Imath::V3d>& directions) const;

 private:
  std::shared_ptr<const levelset::Volume> volume_;
  std::shared_ptr<const levelset::BlockRanges> ranges_;
  double isovalue_;
  VolumeInside inside_;
};

}  // namespace render
