#pragma once

#include <Imath/ImathVec.h>

#include "levelset/grids/sample.h"
#include "levelset/narrow_band.h"

namespace mapping {

/// Values and gradients of φ of a base, for projecting points onto its iso-surfaces φ = height and
/// tracing curves on them. Cheap to construct; use one object per thread.
class SurfaceField {
 public:
  explicit SurfaceField(const levelset::NarrowBand& band);

  [[nodiscard]] double voxelSize() const { return voxelSize_; }
  [[nodiscard]] double value(const Imath::V3d& p) const { return sampler_.value(p); }
  [[nodiscard]] Imath::V3d gradient(const Imath::V3d& p) const { return sampler_.gradient(p); }
  /// ∇φ / |∇φ|; zero outside the band.
  [[nodiscard]] Imath::V3d normal(const Imath::V3d& p) const;
  /// Moves p along ∇φ until φ = height within a hundred-thousandth of a voxel: p ← p − (φ − height)
  /// ∇φ. At a crease, where the steps oscillate, a hundredth of a voxel suffices. Returns false,
  /// with the last p, if p leaves the band or meets a ridge of φ, or where an open surface breaks
  /// off.
  [[nodiscard]] bool project(Imath::V3d& p, double height) const;
  /// True if p lies more than a voxel beyond the border of an open surface, where the band
  /// continues.
  [[nodiscard]] bool isBeyondBorder(const Imath::V3d& p) const {
    return isOpen_ && sampler_.beyondBorder(p) > voxelSize_;
  }

 private:
  levelset::BandSampler sampler_;
  double voxelSize_, background_;
  /// True: the band belongs to an open surface, and also covers space beyond its border.
  bool isOpen_;
};

}  // namespace mapping
