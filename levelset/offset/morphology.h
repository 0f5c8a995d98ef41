#pragma once

#include "levelset/offset/offset.h"

/// Opening, closing and hollowing of solids, by offsets with exact distances.
namespace levelset {

/// Computes the union of all balls of radius `radius` that fit into the solid. Parts thinner than
/// twice the radius disappear. Convex edges become round; concave edges and thicker parts stay.
/// Offsets the solid inwards, then outwards.
/// @param radius  radius of the balls, world units, ≥ 0
/// @throws UsageError unless `radius` is finite and ≥ 0
/// @throws InvalidInput if `solid` or the result is empty
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled
[[nodiscard]] NarrowBand opening(const NarrowBand& solid, double radius,
                                 const OffsetOptions& options = {});

/// Computes the complement of all balls of radius `radius` that fit outside the solid. Fills gaps
/// narrower than twice the radius and rounds concave edges. Offsets the solid outwards, then
/// inwards.
/// @param radius  radius of the balls, world units, ≥ 0
/// @throws as opening()
[[nodiscard]] NarrowBand closing(const NarrowBand& solid, double radius,
                                 const OffsetOptions& options = {});

enum class ShellSide {
  In,   ///< the wall lies inside the surface of the solid
  Out,  ///< the wall lies outside the surface of the solid
  Both  ///< half of the wall's thickness lies on each side of the surface
};

/// Hollows a solid: keeps a wall along its surface.
/// @param thickness  thickness of the wall, world units, at least one voxel
/// @throws UsageError unless `thickness` is finite and positive
/// @throws InvalidInput if `solid` is empty, the wall is thinner than a voxel, or the solid is too
///         thin for a cavity
/// @throws ResourceLimit if the memory estimate exceeds the limit
/// @throws Cancelled
[[nodiscard]] NarrowBand shell(const NarrowBand& solid, double thickness,
                               ShellSide side = ShellSide::In, const OffsetOptions& options = {});

/// Options of the operators `open` and `close`.
struct MorphologyOptions {
  double radius = 0;  ///< radius of the ball, world units
  std::optional<double> halfWidth;
  std::optional<Mask> mask;

  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("radius", &MorphologyOptions::radius,
          {.help = "radius of the ball that opens or closes the solid",
           .unit = OptionUnit::Length,
           .range = OptionRange::NonNegative,
           .required = true,
           .position = 0});
    visit("half-width", &MorphologyOptions::halfWidth, kResultHalfWidth);
    visit("mask", &MorphologyOptions::mask, {});
  }
};

/// Plan, region of interest and cost of the operators `open` and `close`.
struct MorphologyOperator {
  using Options = MorphologyOptions;
  static constexpr Slope slope = Slope::OfOperands;
  static constexpr double partTolerance = kDistanceTolerance;
  static constexpr int distancePasses = 4;

  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

/// The operator `open`.
struct OpenOperator : MorphologyOperator {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, 0.6, 0, "opening-closing"};
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
};

/// The operator `close`.
struct CloseOperator : MorphologyOperator {
  static const OperatorText text;
  static constexpr ErrorModel errorModel{2, 0.6, kCreaseError, "opening-closing"};
  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
};

/// The operator `shell`.
struct ShellOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::OfOperands;
  static constexpr double partTolerance = kDistanceTolerance;
  static constexpr int distancePasses = 3;
  static constexpr ErrorModel errorModel{2, kTriangleError, kCreaseError, "shell"};

  struct Options {
    double thickness = 0;  ///< thickness of the wall, world units
    ShellSide side = ShellSide::In;
    std::optional<double> halfWidth;
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("thickness", &Options::thickness,
            {.help = "thickness of the wall, at least one voxel",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive,
             .required = true});
      visit("side", &Options::side,
            {{"in", ShellSide::In}, {"out", ShellSide::Out}, {"both", ShellSide::Both}},
            {.help = "position of the wall: inside the surface, outside, or half on each side"});
      visit("half-width", &Options::halfWidth, kResultHalfWidth);
      visit("mask", &Options::mask, {});
    }
  };

  static NarrowBand run(std::vector<NarrowBand> operands, const Options& options, OperatorRun& run);
  static ValuePlan plan(const Options& options, Plans operands, const OperatorRun& run);
  static RegionOfInterest regionOfInterest(const Options& options, const OperatorPlans& plans,
                                           std::size_t operand, const RegionOfInterest& ofResult);
  static std::optional<Cost> cost(const Options& options, const OperatorPlans& plans);
};

}  // namespace levelset
