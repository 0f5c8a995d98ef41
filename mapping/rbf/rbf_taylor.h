#pragma once

#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mapping/rbf/rbf_map.h"

namespace mapping {

/// A polynomial in x, y, z of total degree five or less with vectors for coefficients: what far
/// particles add to a smooth map about one place.
class TaylorPolynomial {
 public:
  static constexpr int kDegree = 5;
  static constexpr std::size_t kTerms = 56;
  struct Powers {
    int x, y, z;
    [[nodiscard]] int total() const { return x + y + z; }
  };
  TaylorPolynomial() { terms_.fill(Imath::V3d(0)); }
  /// Of each term, in an order of growing total degree.
  static const std::array<Powers, kTerms>& powers();

  [[nodiscard]] const Imath::V3d& operator[](std::size_t term) const { return terms_[term]; }
  void addAffine(const Imath::V3d& value, const Imath::M33d& rows);
  /// weight × |way + s|, expanded in s. [Duan01] for the recurrence of its coefficients.
  /// @pre way is not zero
  void addDistance(const Imath::V3d& way, const Imath::V3d& weight);
  /// The same polynomial about a place that lies `by` from the old one.
  void shift(const Imath::V3d& by);
  /// Rows: gradients of the three components at s.
  [[nodiscard]] Imath::M33d slopes(const Imath::V3d& s) const;
  [[nodiscard]] Imath::V3d value(const Imath::V3d& s) const;

 private:
  std::array<Imath::V3d, kTerms> terms_;
};

/// A smooth map in scaled units about the middle of a cube: u, v and w are multiplied by the sizes
/// of the patch, so that slopes are about 1.
struct RbfCube {
  Imath::V3d center{0};  ///< relative to the map's origin
  double half = 0;       ///< of the edge, world units
  TaylorPolynomial far;
  double slopeError = 0, valueError = 0;  ///< of the polynomial in the cube's ball
  std::vector<std::uint32_t> near;        ///< particles that it does not hold

  [[nodiscard]] double radius() const { return half * 1.7320508075688774; }
};

/// Cubes of a smooth map, ever smaller: particles far from a cube are summed into its polynomial,
/// which its octants inherit.
class RbfCubes {
 public:
  /// @param map        of the kernel r
  /// @param sizes      that u, v and w are multiplied by
  /// @param tolerance  of the far particles' slopes together, in scaled units
  RbfCubes(const RbfMap& map, const Imath::V3d& sizes, double tolerance);

  [[nodiscard]] RbfCube root(const Imath::V3d& center, double half) const;
  /// Upper half along x, y, z where bit 1, 2, 4 is set.
  [[nodiscard]] RbfCube octant(const RbfCube& cube, int bits) const;
  /// Scaled weights; positions relative to the map's origin.
  [[nodiscard]] std::span<const RbfParticle> particles() const { return particles_; }
  [[nodiscard]] double weightNorm(std::uint32_t particle) const { return norms_[particle]; }
  /// Rows: scaled gradients at a place in the cube. At a particle, its own kink counts nothing.
  [[nodiscard]] Imath::M33d slopes(const RbfCube& cube, const Imath::V3d& place) const;
  /// Scaled u, v and w.
  [[nodiscard]] Imath::V3d value(const RbfCube& cube, const Imath::V3d& place) const;

 private:
  /// Moves particles that are far enough from `candidates` into the cube's polynomial.
  void sumFar(RbfCube& cube, std::span<const std::uint32_t> candidates) const;

  std::vector<RbfParticle> particles_;
  std::vector<double> norms_;
  Imath::M33d linear_;
  Imath::V3d constant_{0};
  double farRatio_ = 0;  ///< of a cube's radius to the distance, at which a particle is far
};

}  // namespace mapping
