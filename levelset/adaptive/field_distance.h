#pragma once

// Internal header of levelset: public headers must not include it.

#include <tbb/enumerable_thread_specific.h>

#include <memory>

#include "levelset/adaptive/adaptive_field.h"
#include "levelset/adaptive/build_adaptive.h"

namespace levelset {

/// An adaptive field as a distance from which another field is made. Beyond the half width, its
/// magnitude is a lower bound of the distance, so that no cell with a part of the surface is
/// skipped.
class FieldDistance final : public SignedDistance {
 public:
  explicit FieldDistance(const AdaptiveField& field);
  // Copies have samplers of their own.
  FieldDistance(const FieldDistance& other) : FieldDistance(other.field_) {}
  FieldDistance& operator=(const FieldDistance&) = delete;

  [[nodiscard]] double at(const Imath::V3d& position, const Known& known) const override;
  [[nodiscard]] Imath::V3d gradient(const Imath::V3d& position) const {
    return samplers_.local().gradient(position);
  }
  [[nodiscard]] Imath::V3d gradient(const Imath::V3d& position, double /*value*/,
                                    double /*step*/) const override {
    return gradient(position);
  }

 private:
  AdaptiveField field_;
  mutable tbb::enumerable_thread_specific<AdaptiveSampler> samplers_;
};

}  // namespace levelset
