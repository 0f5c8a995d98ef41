#pragma once

#include <Imath/ImathVec.h>

#include <memory>

#include "levelset/narrow_band.h"

namespace levelset {

enum class Interpolation {
  Trilinear,
  Tricubic  ///< Catmull-Rom, 64 samples: interpolates the grid values, C¹
};

/// Samples a band at world positions. Caches the path through the tree. Cheap to construct; use one
/// per thread. Outside the band the value is ± background and the gradient zero.
class BandSampler {
 public:
  explicit BandSampler(const NarrowBand& band,
                       Interpolation interpolation = Interpolation::Trilinear);
  ~BandSampler();
  BandSampler(BandSampler&&) noexcept;
  BandSampler& operator=(BandSampler&&) noexcept;

  [[nodiscard]] double value(const Imath::V3d& world) const;
  /// Analytic gradient of the interpolant, world units per world unit.
  [[nodiscard]] Imath::V3d gradient(const Imath::V3d& world) const;
  /// Unit normal by central differences of the interpolant, one voxel apart; zero where the
  /// difference vanishes.
  [[nodiscard]] Imath::V3d normal(const Imath::V3d& world) const;
  /// Returns true when all grid points that value() reads are active.
  [[nodiscard]] bool isInBand(const Imath::V3d& world) const;
  /// The band extends an open surface straight beyond its border. Returns the distance from the
  /// border to the point of this extension that is closest to `world`. World units, interpolated
  /// trilinearly. 0 where the closest point lies on the surface itself, for solids, and outside the
  /// band.
  [[nodiscard]] double beyondBorder(const Imath::V3d& world) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace levelset
