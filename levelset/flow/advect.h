#pragma once

#include <memory>
#include <optional>

#include "levelset/fields/field.h"
#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

enum class AdvectScheme {
  /// Triangle surface whose vertices follow the flow; converted to a band at the end. Preserves
  /// volume and thin sheets, since nothing is interpolated on a grid during the motion.
  Front,
  /// φ at the feet of backward characteristics, interpolated tricubically. Steps of several voxels;
  /// redistanced after each [Strain99].
  SemiLagrangian,
  /// Upwind differences: fifth-order HJ-WENO and third-order TVD Runge-Kutta. Steps below one voxel
  /// [Jiang00, Shu88]; redistanced every voxel and a half.
  Upwind
};

struct AdvectOptions {
  double start = 0;  ///< time of the velocity at the start of the motion
  AdvectScheme scheme = AdvectScheme::Front;
  bool fixVolume = false;         ///< offset the result to the volume of the solid
  std::optional<Mask> mask = {};  ///< scales the velocity
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct AdvectResult {
  NarrowBand band;
  std::size_t steps = 0;
  double volumeBefore = 0, volumeAfter = 0;  ///< world units³; after: before fixVolume
};

/// Moves a solid with a velocity field: φ_t + u·∇φ = 0.
///
/// A grid cannot hold sheets thinner than its voxels. Enright's deformation there and back on 64³
/// costs the upwind scheme 30 % of the volume (OpenVDB's: 44 %), and the front 0.1 %. A reference
/// map on the same grid was tried and failed for the same reason: it stretches fortyfold between
/// two grid points. Triangles that are split where they stretch keep both sides of a sheet, however
/// near they come to each other.
///
/// @param velocity  world units per unit of time; evaluated only near the surface, and only at
///                  times within the current step
/// @param time      duration; negative runs backwards
/// @return a band with the transform and half width of `solid`. It lacks parts thinner than about a
///         voxel; Advection keeps them until the band is requested
/// @throws InvalidInput if `solid` is empty, if the velocity is not finite on the path of the
///         surface, or if no part thick enough for the grid is left
/// @throws UsageError for times that are not finite
/// @throws ResourceLimit for too many steps, triangles or voxels
/// @throws Cancelled
[[nodiscard]] AdvectResult advect(NarrowBand solid, const VectorField& velocity, double time,
                                  const AdvectOptions& options = {});

/// Advection step by step, for a velocity that becomes known only as time advances (a simulation).
/// Parts thinner than a voxel survive between the calls, unlike through a band.
class Advection {
 public:
  explicit Advection(NarrowBand solid, const AdvectOptions& options = {});
  ~Advection();
  Advection(Advection&&) noexcept;
  Advection& operator=(Advection&&) noexcept;

  /// Advances by `time`. The velocity is evaluated only at times within that interval.
  void advance(const VectorField& velocity, double time);
  [[nodiscard]] AdvectResult result() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace levelset
