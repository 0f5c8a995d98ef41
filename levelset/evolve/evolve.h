#pragma once

#include <optional>
#include <vector>

#include "levelset/fields/field.h"
#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

/// Points near which a surface moves. The factor of the speed is 1 at a point and falls to 0 at the
/// distance `radius` t = 1 as 1 − 3t² + 2t³.
struct PointFalloff {
  std::vector<Imath::V3d> points = {};  ///< world units; at least one
  double radius = 0;                    ///< world units, > 0
};

struct EvolveOptions {
  double start = 0;   ///< time at which the motion starts, passed to the speed
  int order = 5;      ///< order in space: 1 (upwind differences), 2 or 3 (HJ-ENO) or 5 (HJ-WENO)
  int timeOrder = 3;  ///< order in time: 1 (Euler), 2 or 3 (TVD Runge-Kutta)
  /// Courant number of the upwind differences, in (0, 1].
  double cfl = 0.5;
  std::optional<Mask> mask = {};          ///< weight that multiplies the speed; empty: 1
  std::optional<PointFalloff> near = {};  ///< second factor of the speed; empty: 1
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct EvolveResult {
  NarrowBand band;
  std::size_t steps = 0;
  std::size_t redistances = 0;  ///< number of distance transforms
};

/// Moves a surface along its normals by the level-set equation φ_t + F|∇φ| = 0. The surface moves
/// outwards where F > 0.
///
/// F is split into F at curvature 0 and the rest. The first part uses upwind differences: Godunov's
/// scheme, or local Lax-Friedrichs fluxes where F depends on the normal [Osher91]. The rest uses
/// central differences as curvatureFlow() does, with steps of 0.16 h² / |∂F/∂k| at most. The band
/// is redistanced after a travel of 1.5 voxels, or a diffusion over a voxel.
///
/// F is evaluated at all grid points of the band, not only on the surface, with normal and
/// curvature of the level set through each of them. A curvature beyond 2 / voxel size is replaced
/// by that limit.
/// @param time  duration, ≥ 0
/// @return a band with the transform and half width of `solid`; `solid` itself, to the bit, if the
///         speed is zero
/// @throws UsageError for times that are not finite, a negative duration, orders that do not exist,
///         a Courant number outside (0, 1], an invalid mask, or an invalid falloff
/// @throws InvalidInput if `solid` is empty, if the speed is not finite near the surface or grows
///         with the curvature (the motion is not well posed), or if the solid vanishes; the message
///         gives the time
/// @throws ResourceLimit for too many steps or voxels
/// @throws Cancelled
[[nodiscard]] EvolveResult evolve(NarrowBand solid, const NormalSpeed& speed, double time,
                                  const EvolveOptions& options = {});

/// The operator `evolve`.
struct EvolveOperator {
  static const OperatorText text;

  struct Options {
    NormalSpeed speed;
    double time = 0, start = 0;
    int order = 5, timeOrder = 3;
    double cfl = 0.5;
    std::vector<Imath::V3d> points;
    std::optional<double> radius;
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("speed", &Options::speed,
            {.help = "speed F along the outward normal, world units per unit of time: a formula in "
                     "x, y, z, r, the time t, the normal nx, ny, nz and the curvature k = k1 + k2 "
                     "(2 / radius on a ball), or a field",
             .required = true});
      visit(
          "time", &Options::time,
          {.help = "duration of the motion", .range = OptionRange::NonNegative, .required = true});
      visit("start", &Options::start, {.help = "value of t at which the motion starts"});
      visit("order", &Options::order, {{"1", 1}, {"2", 2}, {"3", 3}, {"5", 5}},
            {.help = "order in space: 1 upwind differences, 2 or 3 HJ-ENO, 5 HJ-WENO"});
      visit("time-order", &Options::timeOrder, {{"1", 1}, {"2", 2}, {"3", 3}},
            {.help = "order in time: 1 Euler, 2 or 3 TVD Runge-Kutta"});
      visit("cfl", &Options::cfl,
            {.help = "Courant number of the steps, at most 1: travel of the level sets in a step, "
                     "in voxels, summed over the axes",
             .range = OptionRange::Positive});
      visit("points", &Options::points,
            {.help = "points near which the surface moves; needs --radius"});
      visit("radius", &Options::radius,
            {.help = "distance from --points at which the speed has fallen to zero",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive});
      visit("mask", &Options::mask, {});
    }
  };

  static void check(const Options& options, const GivenOptions& given);
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
};

}  // namespace levelset
