#pragma once

#include <Imath/ImathVec.h>

#include <optional>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/operator/cost.h"
#include "levelset/operator/description.h"
#include "levelset/progress.h"

namespace levelset {

/// Height h(d) of an embossed surface over the distance d from the curve, with u = d / width. It is
/// zero for u ≥ 1.
enum class EmbossProfile {
  Round,  ///< half ellipse: height √(1 − u²)
  Flat,   ///< plateau with a wall that stands normal to the surface: height
  Sharp,  ///< ridge with straight sides: height (1 − u)
  Smooth  ///< bell with continuous curvature: height (1 − u²)³
};

/// Curve along which a surface rises.
struct EmbossCurveShape {
  std::vector<Imath::V3d> points;  ///< world units, finite, at least one
  bool isJoined = true;            ///< true: line segments join the points; false: separate points
  bool isClosed = false;           ///< true: a segment joins the last point to the first
  bool isSpline = false;  ///< true: a Catmull-Rom spline through the points replaces the segments
};

struct EmbossOptions {
  EmbossProfile profile = EmbossProfile::Round;
  /// Half width of the result, voxels; empty: the half width of the given solid.
  std::optional<double> halfWidth = {};
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Lets the surface of a solid rise along a curve. Each point s of the surface moves along its
/// normal n(s) to s + h(d(s)) n(s). Here d(s) is the distance from s to the curve in space, so
/// points of another part of the surface move too if they are within the width. Rising adds the
/// segments from s to the moved points to the solid; sinking removes them. So a hole may pass
/// through a wall, a groove may run over an edge, and a ridge may join another part of the surface.
///
/// Extends d off the surface by closest points: a grid point x with the closest point c gets the
/// distance from (d(c), φ(x)) to the graph of h. The zero set of this field is the new surface. The
/// field is exact where the old surface is a plane and the curve is a point or a straight segment.
/// Beyond the medial axis of the old surface the moves continue along their normals. Values near
/// the curve are re-distanced once. Values farther than width + |height| + half width from the
/// curve keep their bits. A height of zero returns the solid itself.
/// @param width   distance from the curve at which the height falls to zero (half of the full
///                width), world units, > 0
/// @param height  height on the curve, world units; negative: the surface sinks
/// @throws UsageError if a length or a point is not finite, the width is not positive, or there is
///         no point
/// @throws InvalidInput if the solid or the result is empty, or if no part of the surface is within
///         the width of the curve
/// @throws ResourceLimit, Cancelled
[[nodiscard]] NarrowBand emboss(const NarrowBand& solid, const EmbossCurveShape& curve,
                                double width, double height, const EmbossOptions& options = {});

/// The operator `emboss`.
struct EmbossOperator {
  static const OperatorText text;
  static constexpr Slope slope = Slope::OfOperands;
  static constexpr double partTolerance = kDistanceTolerance;
  static constexpr int distancePasses = 0;  // a part that the curve does not reach is refused
  static constexpr ErrorModel errorModel{2, 0.5, kCreaseError, "emboss-ball"};

  struct Options {
    std::vector<Imath::V3d> curve;   ///< world units; empty: `points` are given
    std::vector<Imath::V3d> points;  ///< world units; empty: `curve` is given
    double width = 0;                ///< as in emboss(): half of the full width, world units
    double height = 0;               ///< world units, any sign
    EmbossProfile profile = EmbossProfile::Round;
    bool closed = false;
    bool smoothCurve = false;
    std::optional<double> halfWidth;

    template <class Visitor>
    static void describe(Visitor& visit) {
      visit("curve", &Options::curve,
            {.help = "points of a curve near the surface, \"x,y,z x,y,z …\"; line segments join "
                     "them"});
      visit("points", &Options::points,
            {.help = "separate points near the surface, in place of a curve"});
      visit("width", &Options::width,
            {.help = "distance from the curve at which the height falls to zero: half of the full "
                     "width",
             .unit = OptionUnit::Length,
             .range = OptionRange::Positive,
             .required = true});
      visit("height", &Options::height,
            {.help = "height on the curve, along the normal; negative: the surface sinks",
             .unit = OptionUnit::Length,
             .required = true});
      visit("profile", &Options::profile,
            {{"round", EmbossProfile::Round},
             {"flat", EmbossProfile::Flat},
             {"sharp", EmbossProfile::Sharp},
             {"smooth", EmbossProfile::Smooth}},
            {.help = "section across the curve: half ellipse, plateau with walls, ridge with "
                     "straight sides, or bell"});
      visit("closed", &Options::closed, {.help = "join the last point of the curve to the first"});
      visit("smooth-curve", &Options::smoothCurve,
            {.help = "draw a Catmull-Rom spline through the points of the curve"});
      visit("half-width", &Options::halfWidth, kResultHalfWidth);
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
