#pragma once

#include <optional>

#include "levelset/fields/grid.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct ClosestPointOptions {
  /// Largest distance from the surface, voxels; empty: half width of the solid.
  std::optional<double> halfWidth = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Computes the closest-point transform: for each grid point nearer to the surface than the half
/// width, the closest point of the surface, in world units. Uses the same search as redistance(),
/// so φ at that point is zero to the order of the tricubic interpolant. Coordinates are stored as
/// float: at 10⁶ voxels from the origin their resolution is a sixteenth of a voxel.
/// @throws InvalidInput for an empty solid
/// @throws UsageError for a half width below 1
/// @throws ResourceLimit when the result does not fit into memory
/// @throws Cancelled
[[nodiscard]] FieldGrid closestPoints(const NarrowBand& solid,
                                      const ClosestPointOptions& options = {});

/// Extends a scalar attribute off the surface along its normals: each grid point within the half
/// width gets the value of the attribute at its closest point of the surface, so ∇φ · ∇q = 0. Other
/// grid points get 0.
/// @throws as closestPoints()
/// @throws UsageError also when `attribute` is an empty function
/// @throws InvalidInput also when the attribute is not finite
[[nodiscard]] FieldGrid extendOffSurface(const NarrowBand& solid, const ScalarField& attribute,
                                         const ClosestPointOptions& options = {});

/// Extends a vector attribute, evaluated at time 0, off the surface like a scalar attribute.
/// @throws as for a scalar attribute
[[nodiscard]] FieldGrid extendOffSurface(const NarrowBand& solid, const VectorField& attribute,
                                         const ClosestPointOptions& options = {});

/// The operator `closest-point`.
struct ClosestPointOperator {
  static const OperatorText text;

  struct Options {
    /// Half width of the result, voxels; empty: that of the operand.
    std::optional<double> halfWidth;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("half-width", &Options::halfWidth, kResultHalfWidth);
    }
  };

  static FieldGrid run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
