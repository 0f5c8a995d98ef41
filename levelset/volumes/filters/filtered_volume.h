#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include "levelset/splines/grid_extension.h"
#include "levelset/volumes/filters/volume_filter.h"
#include "levelset/volumes/volume.h"

namespace levelset {

/// Value, gradient and second derivatives of a function at a point.
struct VolumeDerivatives {
  double value = 0;
  Imath::V3d gradient = Imath::V3d(0);
  Imath::M33d hessian = Imath::M33d(0.0);  ///< symmetric
};

/// Continuous function that a filter makes of a volume. All derivatives are analytic, in double
/// precision. At a point where a derivative jumps (factsOf(filter).continuity) it is that of one of
/// the cells there, and always of the same one.
///
/// Beyond the border, the samples of a filter continue along each axis by the rule GridExtension.
/// With a parabola (the default) a filter keeps its polynomials up to degree two at the border.
/// The function itself ends at the border: positions outside are moved to the nearest one in index
/// space, and the derivatives are those there.
///
/// The class has value semantics. Copies share the numbers. All methods may run concurrently.
class FilteredVolume {
 public:
  FilteredVolume(Volume volume, VolumeFilter filter,
                 GridExtension border = GridExtension::Quadratic);

  [[nodiscard]] const Volume& volume() const { return volume_; }
  [[nodiscard]] VolumeFilter filter() const { return filter_; }

  /// Returns the value. @param index  position in index coordinates: grid points are whole numbers
  [[nodiscard]] double value(const Imath::V3d& index) const;
  /// Returns value and derivatives per grid spacing. @param index  position in index coordinates
  [[nodiscard]] VolumeDerivatives derivatives(const Imath::V3d& index) const;
  /// Returns value and derivatives per world unit. @param world  position in world space
  [[nodiscard]] VolumeDerivatives worldDerivatives(const Imath::V3d& world) const;

 private:
  Volume volume_;
  VolumeFilter filter_;
  GridExtension border_;
  Imath::M44d worldToIndex_;
};

}  // namespace levelset
