#pragma once

#include <Imath/ImathVec.h>

#include "levelset/grids/sample.h"
#include "levelset/narrow_band.h"

namespace mapping {

/// The layers φ = height of a base as surfaces to walk on. Cheap to make, one per thread.
class SurfaceField {
 public:
  explicit SurfaceField(const levelset::NarrowBand& band);

  [[nodiscard]] double voxelSize() const { return voxelSize_; }
  [[nodiscard]] double value(const Imath::V3d& p) const { return sampler_.value(p); }
  [[nodiscard]] Imath::V3d gradient(const Imath::V3d& p) const { return sampler_.gradient(p); }
  /// ∇φ / |∇φ|; zero outside the band.
  [[nodiscard]] Imath::V3d normal(const Imath::V3d& p) const;
  /// Moves p along ∇φ until φ = height, to a hundred-thousandth of a voxel: p ← p − (φ − height)
  /// ∇φ. False, with p where it stuck, when the way leaves the band or meets a ridge of φ, and
  /// where an open surface breaks off.
  [[nodiscard]] bool project(Imath::V3d& p, double height) const;
  /// Does p lie by more than a voxel beyond the border of an open surface, where the band goes on?
  [[nodiscard]] bool isBeyondBorder(const Imath::V3d& p) const {
    return isOpen_ && sampler_.beyondBorder(p) > voxelSize_;
  }

 private:
  levelset::BandSampler sampler_;
  double voxelSize_, background_;
  bool isOpen_;  ///< what is cut off is no surface
};

}  // namespace mapping
