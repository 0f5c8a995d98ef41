#pragma once

#include <memory>
#include <optional>

#include "levelset/advection/velocity.h"
#include "levelset/fields/field.h"
#include "levelset/fields/mask.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

enum class AdvectScheme {
  /// Triangle surface whose vertices follow the flow; converted to a band at the end. Preserves
  /// volume and thin sheets, since nothing is interpolated on a grid during the motion.
  Front,
  /// Interpolates φ tricubically at the feet of backward characteristics. Steps of several voxels;
  /// redistances after each step [Strain99].
  SemiLagrangian,
  /// Upwind differences and TVD Runge-Kutta steps, of the orders in AdvectOptions. Steps below one
  /// voxel [Jiang00, Shu88]; redistances whenever the surface has moved 1.5 voxels.
  Upwind
};

struct AdvectOptions {
  double start = 0;  ///< time at which the motion starts, passed to the velocity
  AdvectScheme scheme = AdvectScheme::Front;
  /// Order in space of the upwind scheme: 1 (upwind differences), 2 or 3 (HJ-ENO) or 5 (HJ-WENO).
  int order = 5;
  /// Order in time of the upwind scheme: 1 (Euler), 2 or 3 (TVD Runge-Kutta).
  int timeOrder = 3;
  bool fixVolume = false;  ///< offset the result so that it has the volume of the given solid
  std::optional<Mask> mask = {};  ///< weight that multiplies the velocity; empty: 1
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct AdvectResult {
  NarrowBand band;
  std::size_t steps = 0;
  /// Volumes of the given solid and of the moved solid, world units³. The latter is measured before
  /// fixVolume corrects the result.
  double volumeBefore = 0, volumeAfter = 0;
};

/// Moves a solid with a velocity field: φ_t + u·∇φ = 0.
///
/// A grid cannot represent sheets thinner than its voxels. In Enright's test, a deformation and its
/// reversal on a 64³ grid, the upwind scheme loses 30 % of the volume (OpenVDB's: 44 %), and the
/// front 0.1 %. A reference map (start positions stored on the same grid) was tried and failed for
/// the same reason: it stretches fortyfold between two grid points. Triangles that are split where
/// they stretch keep both sides of a sheet, however close the two sides come.
///
/// @param velocity  world units per unit of time; evaluated only near the surface, and only at
///                  times within the current step
/// @param time      duration; negative runs backwards
/// @return a band with the transform and half width of `solid`. It lacks parts thinner than about a
///         voxel; the class Advection keeps such parts between steps
/// @throws InvalidInput if `solid` is empty, if the velocity is not finite on the path of the
///         surface, or if no part thick enough for the grid is left
/// @throws UsageError for times that are not finite, and for orders that do not exist
/// @throws ResourceLimit for too many steps, triangles or voxels
/// @throws Cancelled
[[nodiscard]] AdvectResult advect(NarrowBand solid, const VectorField& velocity, double time,
                                  const AdvectOptions& options = {});

/// Advects a solid step by step, for a velocity that becomes known only as time advances (a
/// simulation). With AdvectScheme::Front the surface stays a mesh between the calls of advance(),
/// so parts thinner than a voxel survive. They would be lost by calling advect() for each step.
class Advection {
 public:
  explicit Advection(NarrowBand solid, const AdvectOptions& options = {});
  ~Advection();
  Advection(Advection&&) noexcept;
  Advection& operator=(Advection&&) noexcept;

  /// Moves the solid for the duration `time`, negative: backwards. Evaluates the velocity only at
  /// times within that interval.
  void advance(const VectorField& velocity, double time);
  [[nodiscard]] AdvectResult result() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The operator `advect`.
struct AdvectOperator {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, 1.1, 0, "rigid-rotation"};

  struct Options {
    NamedVelocity field;
    double time = 0, start = 0;
    AdvectScheme scheme = AdvectScheme::Front;
    int order = 5, timeOrder = 3;
    std::optional<double> period;  ///< time after which a solid moved by a built-in velocity is
                                   ///< back at its start; empty: default of that velocity
    Imath::V3d center = Imath::V3d(0), axis = Imath::V3d(0, 0, 1);
    std::string factor;  ///< formula in t that multiplies the velocity; empty: 1
    bool fixVolume = false;
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("field", &Options::field,
            {.help = "velocity that moves the surface, world units per unit of time",
             .required = true});
      visit("time", &Options::time,
            {.help = "duration of the motion; negative: backwards in time", .required = true});
      visit("start", &Options::start, {.help = "time at which the motion starts"});
      visit("scheme", &Options::scheme,
            {{"front", AdvectScheme::Front},
             {"semi-lagrangian", AdvectScheme::SemiLagrangian},
             {"upwind", AdvectScheme::Upwind}},
            {.help = "scheme: front moves triangles of the surface; semi-lagrangian and upwind "
                     "move the values on the grid"});
      visit("order", &Options::order,
            {.help = "with --scheme upwind: order in space; 1 upwind differences, 2 or 3 HJ-ENO, 5 "
                     "HJ-WENO",
             .range = OptionRange::Positive});
      visit("time-order", &Options::timeOrder,
            {.help = "with --scheme upwind: order in time; 1 Euler, 2 or 3 TVD Runge-Kutta",
             .range = OptionRange::Positive});
      visit(
          "period", &Options::period,
          {.help =
               "time after which a solid that a built-in velocity moves from time 0 is back at its "
               "start; default: enright 3, vortex 8, rotation 1",
           .range = OptionRange::Positive});
      visit("center", &Options::center, {.help = "with --field rotation: a point on the axis"});
      visit("axis", &Options::axis, {.help = "with --field rotation: direction of the axis"});
      visit("factor", &Options::factor, {.help = "formula in t that multiplies the velocity"});
      visit(
          "fix-volume", &Options::fixVolume,
          {.help =
               "offset the result so that it has the volume that the solid had before the motion"});
      visit("mask", &Options::mask, {});
    }
  };

  static void check(const Options& options, const GivenOptions& given);
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
};

}  // namespace levelset
