#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathPlane.h>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

/// Cuts a solid to the inside of an axis-aligned box in world units. The faces of the box close the
/// cut.
/// @throws UsageError if the box is empty
/// @throws InvalidInput if the result is empty
[[nodiscard]] NarrowBand clip(const NarrowBand& solid, const Imath::Box3d& box,
                              const Progress& progress = {});

/// Cuts a solid to one side of a plane, the side that its normal points away from. The plane closes
/// the cut.
/// @throws UsageError if the normal or the distance is not finite, or the normal is zero
/// @throws InvalidInput if the result is empty
[[nodiscard]] NarrowBand clip(const NarrowBand& solid, const Imath::Plane3d& plane,
                              const Progress& progress = {});

/// The operator `clip`.
struct ClipOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::OfOperands;
  static constexpr ErrorModel errorModel{2, kTriangleError, kCreaseError, "csg-balls"};

  struct Options {
    std::optional<Imath::Box3d> box;  ///< clip box, world units; empty: `plane` is given
    std::vector<Imath::V3d> plane;    ///< point and normal, world units; empty: `box` is given

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("box", &Options::box, {.help = "keep the part of the solid inside this box"});
      visit("plane", &Options::plane,
            {.help = "point and normal of a plane, \"x,y,z x,y,z\": keep the part of the solid on "
                     "the side opposite to the normal"});
    }
  };

  static void check(const Options& options, const GivenOptions& given);
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
