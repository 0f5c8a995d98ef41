#pragma once

#include <optional>

#include "levelset/fields/grid.h"
#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

struct ClosestPointOptions {
  std::optional<double> halfWidth = {};  ///< how far from the surface, voxels; empty: as the solid
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// The closest-point transform: for each grid point nearer to the surface than the half width, the
/// point of the surface closest to it, in world units. Found as redistance() does, so φ there is
/// zero to the order of the tricubic interpolant; stored as float, so at coordinates of 10⁶ voxels
/// to a sixteenth of a voxel.
/// @throws InvalidInput for an empty solid; UsageError for a half width below 1; ResourceLimit;
///         Cancelled
[[nodiscard]] FieldGrid closestPoints(const NarrowBand& solid,
                                      const ClosestPointOptions& options = {});

/// Carries an attribute off the surface along its normals: at each grid point the value that the
/// attribute has at the closest point, so ∇φ · ∇q = 0. Elsewhere 0.
/// @throws UsageError also when the attribute is not set; InvalidInput also when it is not finite
[[nodiscard]] FieldGrid extendOffSurface(const NarrowBand& solid, const ScalarField& attribute,
                                         const ClosestPointOptions& options = {});

/// The same of an attribute of vectors, at time 0.
[[nodiscard]] FieldGrid extendOffSurface(const NarrowBand& solid, const VectorField& attribute,
                                         const ClosestPointOptions& options = {});

/// The operator `closest-point`.
struct ClosestPointOperator {
  static const OperatorText text;

  struct Options {
    std::optional<double> halfWidth;  ///< of the result, voxels

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
