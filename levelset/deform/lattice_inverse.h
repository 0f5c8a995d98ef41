#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <optional>
#include <vector>

#include "levelset/deform/control_lattice.h"
#include "levelset/deform/deformation.h"

namespace levelset {

/// Inverse of a lattice that is injective in its box, see certifyLattice(). Read-only after
/// construction, so threads may share it.
class LatticeInverse final : public DeformationInverse {
 public:
  explicit LatticeInverse(const ControlLattice& lattice);

  /// Finds the point that the lattice maps to a position, by Newton's method from a guess. An
  /// injective map has one such point at most, so any point that Newton's method finds is the right
  /// one. If it finds none, the deformed pieces are searched as at().
  /// @return world coordinates before the deformation; may lie outside the box, where the map
  ///         continues linearly. nullopt: no point of the box maps there, and no guess led to a
  ///         point outside
  [[nodiscard]] std::optional<Imath::V3d> near(const Imath::V3d& position,
                                               const Imath::V3d& guess) const override;

  /// Finds the point of the box that the lattice maps to a position. The control points of a piece
  /// bound its image. Pieces whose bounds contain the position are halved until Newton's method
  /// finds the point from the middle of a part. Parts whose bounds do not contain it are excluded,
  /// so nullopt proves that there is no such point.
  [[nodiscard]] std::optional<Imath::V3d> at(const Imath::V3d& position) const;

 private:
  [[nodiscard]] std::optional<Imath::V3d> newton(const Imath::V3d& position,
                                                 const Imath::V3d& guess) const;

  ControlLattice lattice_;
  BezierPieces pieces_;
  std::vector<Imath::Box3d> bounds_;  ///< boxes of the control points, by piece
  double tolerance_ = 0;              ///< largest residual of a result, world units
  double boxSize_ = 0;                ///< diagonal of the box
};

}  // namespace levelset
