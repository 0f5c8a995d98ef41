#pragma once

#include <optional>

#include "levelset/csg/csg.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

enum class BlendSide {
  Both,
  Add,    ///< material is only added
  Remove  ///< material is only removed
};

enum class BlendMethod {
  Curvature,  ///< flow along the seam
  Fillet      ///< a ball rolled along it
};

struct BlendOptions {
  BlendSide side = BlendSide::Both;
  BlendMethod method = BlendMethod::Curvature;
  /// Fillet: how far the middle of its arc may be from the seam, world units, > 0; empty: twice the
  /// radius, which is reached where the surfaces meet at 39°.
  std::optional<double> reach = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// CSG and its rounding in one: by curvature flow along the curve in which the two zero sets meet
/// [Museth02, Brodersen07 §6.3]: φ_t = D(d) (κ − clamp(κ, ±1/radius)) |∇φ| with κ = k1 + k2, where
/// d is the distance to the curve and D falls smoothly from 1 to 0 at `radius`. Unlike the plain
/// flow of the sources this one moves only what is bent more sharply than the radius, so it comes
/// to rest as a fillet: a right-angled crease is filled as by a circle of that radius, within 10 %.
/// A sharper crease has no room for it and becomes as round as `radius` to both sides allows.
/// Nothing changes further than `radius` from the curve, so solids that are near but do not meet
/// stay apart.
///
/// Or, with BlendMethod::Fillet, as a ball of that radius leaves it that rolls along the seam and
/// touches both surfaces: between planes at an angle θ (of the space between them) the arc of that
/// radius, with nothing changed beyond radius / tan(θ/2) from the seam. Where the arc would be
/// further from the seam than `reach` the ball is as much smaller, so that surfaces which nearly
/// touch get no bulge. A union's fillet adds material, the others' removes it.
/// @param radius  world units, ≥ 0; 0 is plain CSG
/// @return        notes tell of resampled operands, of surfaces that do not meet (plain CSG then)
/// and
///                of a radius below 1.5 voxels
/// @throws UsageError if `radius` is negative or not finite; InvalidInput if a solid is empty or
/// the
///         radius larger than the solids; ResourceLimit, Cancelled
/// @note needs O(radius) steps over the grid points around the curve
[[nodiscard]] CsgResult blend(CsgOperation operation, const NarrowBand& a, const NarrowBand& b,
                              double radius, const BlendOptions& options = {});

/// The operator `blend`.
struct BlendOperator {
  static const OperatorText text;
  static constexpr std::size_t operandCount = 2;
  static constexpr ErrorModel errorModel{2, 0.5, 0, "fillet-balls"};

  struct Options {
    double radius = 0;  ///< world units
    CsgOperation operation = CsgOperation::Union;
    BlendMethod method = BlendMethod::Curvature;
    std::optional<double> reach;  ///< world units
    BlendSide side = BlendSide::Both;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("radius", &Options::radius,
            {.help = "radius of the rounding",
             .unit = OptionUnit::Length,
             .range = OptionRange::NonNegative,
             .required = true});
      visit("op", &Options::operation,
            {{"union", CsgOperation::Union},
             {"intersection", CsgOperation::Intersection},
             {"difference", CsgOperation::Difference}},
            {.help = "operation whose seam is rounded"});
      visit("method", &Options::method,
            {{"curvature", BlendMethod::Curvature}, {"fillet", BlendMethod::Fillet}},
            {.help = "method that rounds the seam"});
      visit("reach", &Options::reach,
            {.help = "fillet: largest distance of the middle of its arc from the seam, beyond "
                     "which the ball gets smaller; default: twice the radius",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive});
      visit("side", &Options::side,
            {{"both", BlendSide::Both}, {"add", BlendSide::Add}, {"remove", BlendSide::Remove}},
            {.help = "add material, remove it, or both"});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
};

}  // namespace levelset
