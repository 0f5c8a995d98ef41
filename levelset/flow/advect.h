#pragma once

#include <memory>
#include <optional>

#include "levelset/fields/field.h"
#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

enum class AdvectScheme {
  /// The surface as triangles whose vertices follow the flow; it becomes a band again at the end.
  /// Keeps volume and thin sheets: nothing is interpolated on a grid on the path.
  Front,
  /// φ at the feet of backward characteristics by tricubic interpolation, steps of several voxels,
  /// re-distanced after each [Strain99].
  SemiLagrangian,
  /// Upwind differences: HJ-WENO of fifth order and TVD Runge-Kutta of third, steps below one voxel
  /// [Jiang00, Shu88], re-distanced every voxel and a half.
  Upwind
};

struct AdvectOptions {
  double start = 0;  ///< time of the velocity at which the solid is given
  AdvectScheme scheme = AdvectScheme::Front;
  bool fixVolume = false;         ///< offset the result to the volume of the solid
  std::optional<Mask> mask = {};  ///< scales the velocity
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct AdvectResult {
  NarrowBand band;
  std::size_t steps = 0;
  double volumeBefore = 0, volumeAfter = 0;  ///< world units³; after, before any fixing
};

/// Carries a solid along with a velocity: φ_t + u·∇φ = 0.
///
/// Enright's deformation there and back on 64³ costs the upwind scheme 30 % of the volume (44 %
/// with OpenVDB's), since a grid cannot hold sheets thinner than its voxels, and the front 0.1 %. A
/// reference map carried on the same grid was tried and lost its path for the same reason: there it
/// stretches fortyfold between two grid points. Triangles that are split where they stretch keep
/// both sides of a sheet, however near they get to each other.
///
/// @param velocity  world units per unit of time, asked for only near the surface, and only at
///                  times within the step being made
/// @param time      how long; negative runs backwards
/// @return          a band with the transform and half width of `solid`. What ended up thinner than
///                  about a voxel is not in it; Advection keeps it until the band is asked for
/// @throws InvalidInput if `solid` is empty, the velocity is not finite where the surface goes, or
///         nothing thick enough for the grid is left; UsageError for times that are not finite;
///         ResourceLimit for too many steps, triangles or voxels; Cancelled
[[nodiscard]] AdvectResult advect(NarrowBand solid, const VectorField& velocity, double time,
                                  const AdvectOptions& options = {});

/// The same step by step, for a velocity that is known only as time goes on (a simulation):
/// what is thinner than a voxel survives between the calls, unlike through a band.
class Advection {
 public:
  explicit Advection(NarrowBand solid, const AdvectOptions& options = {});
  ~Advection();
  Advection(Advection&&) noexcept;
  Advection& operator=(Advection&&) noexcept;

  /// Goes on by `time` with a velocity that is asked only about times from now to then.
  void advance(const VectorField& velocity, double time);
  [[nodiscard]] AdvectResult result() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace levelset
