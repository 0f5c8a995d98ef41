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
  Curvature,  ///< curvature flow near the seam, the curve in which the surfaces intersect
  Fillet      ///< ball rolled along the seam
};

struct BlendOptions {
  BlendSide side = BlendSide::Both;
  BlendMethod method = BlendMethod::Curvature;
  /// For BlendMethod::Fillet only: largest distance from the seam to the middle of the arc, world
  /// units, > 0. Empty: twice the radius, which limits the ball where the surfaces meet at less
  /// than 39°.
  std::optional<double> reach = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Combines two solids and rounds the crease along the curve in which their zero sets intersect.
///
/// BlendMethod::Curvature integrates the flow φ_t = D(d) (κ − clamp(κ, ±1/radius)) |∇φ| [Museth02,
/// Brodersen07 §6.3]. Here κ = k1 + k2, d is the distance to the curve, and D falls smoothly from 1
/// to 0 at `radius`. Unlike the plain flow of the sources, this flow moves only points with |κ|
/// above 1/radius, so it converges to a fillet. A right-angled crease becomes a circular arc of
/// that radius, within 10 %. A sharper crease becomes only as round as a change within the distance
/// `radius` of the curve allows. Nothing changes farther than `radius` from the curve, so solids
/// that are near but do not intersect stay apart.
///
/// BlendMethod::Fillet rolls a ball of that radius along the seam, in contact with both surfaces.
/// Between planes at an angle θ (of the space between them) the result is an arc of that radius.
/// Nothing changes beyond radius / tan(θ/2) from the seam. Where the arc would be farther from the
/// seam than `reach`, the ball is smaller, so surfaces that nearly touch get no bulge. The fillet
/// of a union adds material; those of the other operations remove it.
/// @param radius  world units, ≥ 0; 0 is plain CSG
/// @return        combined solid; its notes report resampled operands, surfaces that do not
///                intersect (the result is then plain CSG), and a radius below 1.5 voxels
/// @throws UsageError if `radius` is negative or not finite
/// @throws InvalidInput if a solid is empty or the radius is larger than the solids
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled
/// @note BlendMethod::Curvature takes O(radius / voxel size) steps over the grid points around the
///       curve.
[[nodiscard]] CsgResult blend(CsgOperation operation, const NarrowBand& a, const NarrowBand& b,
                              double radius, const BlendOptions& options = {});

/// The operator `blend`.
struct BlendOperator {
  static const OperatorText text;
  static constexpr std::size_t operandCount = 2;
  static constexpr ErrorModel errorModel{2, 0.5, 0, "fillet-balls"};

  struct Options {
    double radius = 0;  ///< radius of the rounding, world units
    CsgOperation operation = CsgOperation::Union;
    BlendMethod method = BlendMethod::Curvature;
    std::optional<double> reach;  ///< as BlendOptions::reach: largest distance from the seam to the
                                  ///< middle of the arc, world units; empty: twice the radius
    BlendSide side = BlendSide::Both;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("radius", &Options::radius,
            {.help = "radius of the rounding along the seam",
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
            {.help = "with --method fillet: largest distance from the seam to the middle of the "
                     "arc; where the arc would be farther away, the ball is smaller; default: "
                     "twice the radius",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive});
      visit("side", &Options::side,
            {{"both", BlendSide::Both}, {"add", BlendSide::Add}, {"remove", BlendSide::Remove}},
            {.help = "effect of the rounding: add material, remove it, or both"});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
};

}  // namespace levelset
