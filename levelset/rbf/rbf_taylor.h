#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "levelset/rbf/rbf_function.h"

namespace levelset::rbf {

/// A polynomial in x, y, z of total degree at most five with vector coefficients: the Taylor
/// expansion, around a point, of the affine part of an RBF map and the sum over far particles.
class TaylorPolynomial {
 public:
  static constexpr int kDegree = 5;
  static constexpr std::size_t kTerms = 56;
  struct Powers {
    int x, y, z;
    [[nodiscard]] int total() const { return x + y + z; }
  };
  TaylorPolynomial() { terms_.fill(Imath::V3d(0)); }
  /// Powers of x, y and z in each term, ordered by total degree.
  static const std::array<Powers, kTerms>& powers();

  [[nodiscard]] const Imath::V3d& operator[](std::size_t term) const { return terms_[term]; }
  void addAffine(const Imath::V3d& value, const Imath::M33d& rows);
  /// Adds weight × |offset + s|, expanded in the offset s from the centre of the expansion, by the
  /// recurrence of [Duan01].
  /// @pre offset is not zero
  void addDistance(const Imath::V3d& offset, const Imath::V3d& weight);
  /// Re-expands the polynomial around a point that is displaced by `by` from the old centre.
  void shift(const Imath::V3d& by);
  /// Jacobian at the offset s from the centre: gradients of the three components as rows.
  [[nodiscard]] Imath::M33d slopes(const Imath::V3d& s) const;
  [[nodiscard]] Imath::V3d value(const Imath::V3d& s) const;

 private:
  std::array<Imath::V3d, kTerms> terms_;
};

/// Expansion of an RBF map around the centre of a cube. The map is scaled: u, v and w are
/// multiplied by the extents of the patch in world units, so that slopes are about 1.
struct RbfCube {
  Imath::V3d center{0};  ///< centre of the cube, relative to the map's origin, world units
  double half = 0;       ///< half edge length, world units
  TaylorPolynomial far;
  /// Error bounds of the polynomial in the ball around the cube: of the scaled slopes, and of the
  /// scaled u, v and w.
  double slopeError = 0, valueError = 0;
  std::vector<std::uint32_t> near;  ///< particles that the polynomial does not contain

  [[nodiscard]] double radius() const { return half * 1.7320508075688774; }
};

/// Hierarchy of cubes for an RBF map. Particles far from a cube are summed into its polynomial,
/// which its octants inherit.
class RbfCubes {
 public:
  /// @param function        a function with the kernel φ(r) = r
  /// @param sizes      factors by which u, v and w are scaled
  /// @param tolerance  error bound for the scaled slopes of all far particles together
  RbfCubes(const RbfFunction& function, const Imath::V3d& sizes, double tolerance);

  [[nodiscard]] RbfCube root(const Imath::V3d& center, double half) const;
  /// Octant of the cube. Bits 1, 2 and 4 of `bits` select the upper half along x, y and z.
  [[nodiscard]] RbfCube octant(const RbfCube& cube, int bits) const;
  /// Particles with weights in scaled u, v and w; positions in world units, relative to the map's
  /// origin.
  [[nodiscard]] std::span<const RbfParticle> particles() const { return particles_; }
  [[nodiscard]] double weightNorm(std::uint32_t particle) const { return norms_[particle]; }
  /// Scaled Jacobian at a point of the cube (relative to the map's origin, world units), gradients
  /// as rows. At a particle the particle's own term, which has no derivative there, adds nothing.
  [[nodiscard]] Imath::M33d slopes(const RbfCube& cube, const Imath::V3d& point) const;
  /// Scaled u, v and w at a point of the cube, given relative to the map's origin, world units.
  [[nodiscard]] Imath::V3d value(const RbfCube& cube, const Imath::V3d& point) const;

 private:
  /// Adds candidates (indices of particles) that are far enough from the cube to its polynomial,
  /// and the others to `cube.near`.
  void sumFar(RbfCube& cube, std::span<const std::uint32_t> candidates) const;

  std::vector<RbfParticle> particles_;
  std::vector<double> norms_;
  Imath::M33d linear_;
  Imath::V3d constant_{0};
  double farRatio_ = 0;  ///< largest ratio of a cube's radius to the distance of a far particle
};

}  // namespace levelset::rbf
