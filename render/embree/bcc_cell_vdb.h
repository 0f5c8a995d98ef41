#pragma once

// Private to the judge: the spline on truncated octahedra in a cell of the grid, in double
// precision. The coefficients come from levelset/splines, which the kernel does not use.

#include <array>
#include <optional>
#include <vector>

#include "levelset/vdb.h"
#include "render/shading/surface_shape.h"

namespace render {

/// The quadratic C¹ spline Q₂ in a cell. Positions run from 0 to 1 in the cell.
class BccCell {
 public:
  BccCell(const openvdb::FloatTree& tree, const openvdb::Coord& cell);

  /// Returns false when bounds on the Bernstein coefficients prove that the spline has no zero.
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
  static constexpr int kPoints = 6;  // on each axis, from two points before the cell on

  [[nodiscard]] double at(int i, int j, int k) const;
  template <typename Visit>
  void overPieces(const Imath::V3d& p, const Imath::V3d& q, const Visit& visit) const;
  [[nodiscard]] std::array<double, 3> inGrid(const Imath::V3d& p) const;

  openvdb::Coord cell_;
  std::array<double, kPoints * kPoints * kPoints> data_;  // ordered by x, y, z
};

/// Returns false when the values in the cells of a block of 8³, and around them, prove that the
/// spline has no zero in the block.
[[nodiscard]] bool bccMayCross(const openvdb::FloatTree& tree, const openvdb::Coord& block);

/// Derivatives of the spline of a grid. @param position  in index space
[[nodiscard]] SurfaceShape bccShape(const openvdb::FloatTree& tree, const Imath::V3d& position);

}  // namespace render
