#pragma once

#include "levelset/solids/offset.h"

/// Opening, closing and hollowing of solids: offsets, of exact distances each.
namespace levelset {

/// All balls of that radius that fit into the solid: parts thinner than twice the radius go, convex
/// edges are rounded to it, concave ones and whatever is thicker stay. The solid moves inwards,
/// then back.
/// @param radius  world units, ≥ 0
/// @throws UsageError unless `radius` is finite and ≥ 0; InvalidInput if `solid` is empty or
///         nothing is left; ResourceLimit; Cancelled
[[nodiscard]] NarrowBand opening(const NarrowBand& solid, double radius,
                                 const OffsetOptions& options = {});

/// The complement of all balls of that radius that fit beside the solid: gaps narrower than twice
/// the radius are filled, concave edges are rounded to it. The solid moves outwards, then back.
/// @throws as opening()
[[nodiscard]] NarrowBand closing(const NarrowBand& solid, double radius,
                                 const OffsetOptions& options = {});

enum class ShellSide {
  In,   ///< the solid's surface is the outer one
  Out,  ///< the solid's surface is the inner one
  Both  ///< half the thickness to each side
};

/// The wall of that thickness along the surface of a solid.
/// @param thickness  world units, at least a voxel
/// @throws UsageError unless `thickness` is finite and positive; InvalidInput if `solid` is empty,
///         the wall thinner than a voxel, or the solid so thin that no cavity is left in it;
///         ResourceLimit; Cancelled
[[nodiscard]] NarrowBand shell(const NarrowBand& solid, double thickness,
                               ShellSide side = ShellSide::In, const OffsetOptions& options = {});

/// Options of the operators `open` and `close`.
struct MorphologyOptions {
  double radius = 0;  ///< world units
  std::optional<double> halfWidth;
  std::optional<Mask> mask;

  template <class Visitor>
  static void describe(Visitor& visit) {
    visit("radius", &MorphologyOptions::radius,
          {.help = "radius of the ball",
           .unit = OptionUnit::Length,
           .range = OptionRange::NonNegative,
           .required = true,
           .position = 0});
    visit("half-width", &MorphologyOptions::halfWidth, kResultHalfWidth);
    visit("mask", &MorphologyOptions::mask, {});
  }
};

/// Estimates that `open` and `close` share.
struct MorphologyOperator {
  using Options = MorphologyOptions;
  static constexpr Slope slope = Slope::OfOperands;
  static constexpr double partTolerance = kDistanceTolerance;

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
  static constexpr ErrorModel errorModel{2, kTriangleError, kCreaseError, "shell"};

  struct Options {
    double thickness = 0;  ///< world units
    ShellSide side = ShellSide::In;
    std::optional<double> halfWidth;
    std::optional<Mask> mask;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("thickness", &Options::thickness,
            {.help = "thickness of the wall, a voxel or more",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive,
             .required = true});
      visit("side", &Options::side,
            {{"in", ShellSide::In}, {"out", ShellSide::Out}, {"both", ShellSide::Both}},
            {.help = "position of the wall: inside the surface, outside, or half and half"});
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
