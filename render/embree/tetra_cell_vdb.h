#pragma once

// Private to the judge: splines on the type-6 partition in a cube, in double precision. The
// coefficients come from the masks of levelset/splines, which the kernel does not use.

#include <array>
#include <optional>
#include <vector>

#include "levelset/vdb.h"
#include "render/filter.h"
#include "render/shading/surface_shape.h"

namespace render {

/// A spline on the 24 tetrahedra of the cube around a grid point. Positions run from 0 to 1 in the
/// cube; the grid point lies at 0.5.
class TetraCell {
 public:
  /// @param datum  the grid point
  /// @param filter  SuperQuadratic or CubicC1
  TetraCell(const openvdb::FloatTree& tree, const openvdb::Coord& datum, Filter filter);

  /// Returns false when all Bernstein coefficients have one sign, so that the spline has no zero.
  [[nodiscard]] bool mayCross() const;
  [[nodiscard]] double value(const Imath::V3d& p) const;
  /// Finds the first fraction of the segment from p to q at which the spline changes sign.
  [[nodiscard]] std::optional<double> firstSignChange(const Imath::V3d& p,
                                                      const Imath::V3d& q) const;
  /// Appends all such fractions, in ascending order.
  void addSignChanges(const Imath::V3d& p, const Imath::V3d& q, std::vector<double>& found) const;
  /// Derivatives at a position, φ per voxel.
  [[nodiscard]] SurfaceShape shape(const Imath::V3d& p) const;

 private:
  template <typename Visit>
  void overPieces(const Imath::V3d& p, const Imath::V3d& q, const Visit& visit) const;

  Filter filter_;
  std::array<double, 27> data_;  // ordered by x, y, z
};

/// Derivatives of the spline of a grid. @param position  half a voxel above index space
[[nodiscard]] SurfaceShape tetraShape(const openvdb::FloatTree& tree, const Imath::V3d& position,
                                      Filter filter);

}  // namespace render
