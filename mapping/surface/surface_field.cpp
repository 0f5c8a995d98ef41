#include "mapping/surface/surface_field.h"

#include <algorithm>
#include <cmath>

namespace mapping {
namespace {

using Imath::V3d;

constexpr int kMaxSteps = 40;
constexpr int kUndampedSteps = 12;
// Accepted |φ − height| before kMaxSteps, voxels; close to the resolution of float distances.
constexpr double kTolerance = 1e-5;
// Accepted |φ − height| after kMaxSteps, voxels; for creases, where the steps oscillate.
constexpr double kAccepted = 1e-2;

}  // namespace

SurfaceField::SurfaceField(const levelset::NarrowBand& band)
    : sampler_(band, levelset::Interpolation::Tricubic),
      voxelSize_(band.voxelSize()),
      background_(band.halfWidth() * band.voxelSize()),
      isOpen_(band.isOpenSurface()) {}

V3d SurfaceField::normal(const V3d& p) const {
  const V3d gradient = sampler_.gradient(p);
  const double length = gradient.length();
  return length > 1e-6 ? gradient / length : V3d(0);
}

bool SurfaceField::project(V3d& p, double height) const {
  double last = 0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double phi = sampler_.value(p);
    const double gap = phi - height;
    if (std::abs(gap) <= kTolerance * voxelSize_) return !isOpen_ || sampler_.isInBand(p);
    // Outside the band the field has no gradient to follow.
    if (std::abs(phi) >= background_ * (1 - 1e-6)) return false;
    const V3d gradient = sampler_.gradient(p);
    const double squared = gradient.length2();
    if (squared < 1e-8) return false;
    // A weak gradient indicates a ridge of φ nearby; a full Newton step would throw p far across
    // it.
    V3d move = gradient * (-gap / std::max(squared, 0.25));
    if (step >= kUndampedSteps) move *= 0.5;
    p += move;
    last = std::abs(gap);
  }
  return last <= kAccepted * voxelSize_ && (!isOpen_ || sampler_.isInBand(p));
}

}  // namespace mapping
