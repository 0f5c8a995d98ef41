#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "levelset/operator/options.h"
#include "levelset/operator/plan.h"
#include "levelset/progress.h"
#include "levelset/region_of_interest.h"

/// Description of an operator, beside the operator itself. The pipeline derives the action of the
/// command line and the function of the Python module from it (apps/pipeline/operators). It is a
/// struct with static members:
///
/// struct OffsetOperator {
///   static const OperatorText text;         // name, group of the help, summary, details, example
///   struct Options;                         // options.h
///   static NarrowBand run(std::vector<NarrowBand> operands, const Options&, OperatorRun&);
///
///   // All that follows may be left out.
///   static constexpr std::size_t operandCount = 1;
///   static constexpr bool takesMore = false;          // further operands may follow
///   static constexpr Slope slope = Slope::Any;
///   static constexpr double partTolerance = 0;        // voxels, see regionOfInterest
///   static constexpr bool makesPart = false;          // run() keeps to OperatorRun::roi
///   static constexpr bool makesSurface = false;       // the result is the band of an open surface
///   static constexpr ErrorModel errorModel = {};
///   static void check(const Options&, const GivenOptions&);      // throws UsageError
///   static double longestSide(const Options&, Plans operands);   // object that VoxelSize divides
///   static ValuePlan plan(const Options&, Plans operands, const OperatorRun&);
///   static RegionOfInterest regionOfInterest(const Options&, const OperatorPlans&, std::size_t
///                                            operand, const RegionOfInterest& ofResult);
///   static std::optional<Cost> cost(const Options&, const OperatorPlans&);
///   static double leastRadius(const Options&);        // of curvature, world units
///   static bool makesField(const Options&);           // run() returns a variant with FieldGrid
/// };
///
/// run() takes a mesh where it is declared with `const TriMesh&` in place of the bands (an operator
/// may have both), no operand where it is declared without. It returns a band, a mesh, a field, or
/// a variant of band and field. plan() is that of the first operand by default.
///
/// regionOfInterest() gives the part of a band operand that decides the result inside `ofResult`,
/// to the bit or to `partTolerance`. An operator without it needs complete operands.
namespace levelset {

struct OperatorText {
  const char* name = "";             ///< the word of the command line
  const char* group = "";            ///< heading in the help
  const char* summary = "";          ///< one line
  const char* details = "";          ///< facts beyond the options
  const char* example = "";          ///< a complete command line
  const char* formerName = nullptr;  ///< a name that scripts used before; it keeps working
};

/// Slope of the band that an operator makes.
enum class Slope {
  Any,        ///< values may be no distances
  One,        ///< values are distances
  OfOperands  ///< values are distances if those of all operands are
};

/// Bound of the distance between the triangles of a zero set and the surface that an action stands
/// for, as the regression suite measures it: `constant` × voxel × (voxel / radius)^(order − 1),
/// with the least radius of curvature; beside creases `creaseConstant` × voxel.
struct ErrorModel {
  double order = 1;
  double constant = 0;        ///< 0: exact away from creases
  double creaseConstant = 0;  ///< 0: makes no creases
  const char* source = "";    ///< case of the regression suite that measured it, docs/regression.md
};

// Largest errors of meshes (`mesh_linf_vx` of results.csv) times radius over voxel, the worst of
// all resolutions and placements of the quick budget, rounded up. An operator that resamples or
// moves a surface adds as much again as its triangles do.
inline constexpr double kTriangleError = 0.35;
inline constexpr double kCreaseError = 0.55;

/// Largest difference, in voxels, between a part of a band and the same part of the complete band,
/// where distances are computed again: values that are right already may be kept in one and not in
/// the other.
inline constexpr double kDistanceTolerance = 1e-4;

using Plans = std::span<const ValuePlan>;

/// Plans of an operator's operands and of its complete result.
struct OperatorPlans {
  Plans operands;
  ValuePlan result;
};

/// The options and operands that a check of the options may ask about.
struct GivenOptions {
  std::function<bool(std::string_view)> isGiven;  ///< by the option's name on the command line
  bool isMesh = false;                            ///< the first operand is a mesh

  [[nodiscard]] bool operator()(std::string_view option) const { return isGiven(option); }
};

/// A figure of a report, by key.
using Figures =
    std::vector<std::pair<std::string, std::variant<double, std::size_t, bool, std::string>>>;

/// An estimate of the error of a result.
struct ErrorEstimate {
  std::string measure;  ///< "eikonal residual, mean"
  double value = 0;
  std::string unit;  ///< "", "voxels" or a world unit
};

/// Circumstances of a run, and what it leaves behind beside its result.
struct OperatorRun {
  RegionOfInterest roi = {};              ///< part of the result that is needed
  std::optional<ValuePlan> planned = {};  ///< plan of the complete result, where it is known
  bool isPartial = false;                 ///< the first operand is narrower than its whole
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};

  std::vector<std::string> notes = {}, warnings = {};
  std::vector<ErrorEstimate> errors = {};
  /// Reason why the result misses a tolerance that was requested; empty: it does not.
  std::string failure = {};
  Figures figures = {};      ///< details for the report
  Figures certificate = {};  ///< of the sign of a band that was made from a mesh
};

}  // namespace levelset
