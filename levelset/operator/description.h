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
///   // All further members may be left out.
///   static constexpr std::size_t operandCount = 1;
///   static constexpr bool takesMore = false;          // true: accepts more operands
///   static constexpr Slope slope = Slope::Any;
///   static constexpr double partTolerance = 0;        // voxels: accuracy of regionOfInterest()
///   static constexpr int distancePasses = 1;          // distance transforms in a row; 0: not in
///   parts static constexpr bool makesPart = false;          // run() computes only
///   OperatorRun::roi static constexpr bool makesSurface = false;       // true: the result is a
///   surface band static constexpr ErrorModel errorModel = {}; static void check(const Options&,
///   const GivenOptions&);      // throws UsageError static double longestSide(const Options&,
///   Plans operands);   // world units, for --resolution static ValuePlan plan(const Options&,
///   Plans operands, const OperatorRun&); static RegionOfInterest regionOfInterest(const Options&,
///   const OperatorPlans&, std::size_t
///                                            operand, const RegionOfInterest& ofResult);
///   static std::optional<Cost> cost(const Options&, const OperatorPlans&);
///   static double leastRadius(const Options&);        // of the result's curvature, world units
///   static bool makesField(const Options&);           // true: the result is a FieldGrid
/// };
///
/// run() may take `const TriMesh&` in place of the bands, or no operand; an operator may have one
/// run() for bands and one for a mesh. run() returns a band, a mesh, a field, or a variant of band
/// and field. By default, plan() returns the plan of the first operand.
///
/// regionOfInterest() returns the part of a band operand that decides the result inside `ofResult`,
/// to the bit or with an error of at most `partTolerance` voxels. An operator without this function
/// reads complete operands.
namespace levelset {

struct OperatorText {
  const char* name = "";             ///< name of the action on the command line
  const char* group = "";            ///< heading in the help
  const char* summary = "";          ///< effect of the operator, one line
  const char* details = "";          ///< help text: facts that the option texts do not give
  const char* example = "";          ///< a complete command line with this action
  const char* formerName = nullptr;  ///< former name that old scripts use; null: none
};

/// Slope |∇φ| of the band that an operator computes.
enum class Slope {
  Any,        ///< the values need not be distances
  One,        ///< the values are distances
  OfOperands  ///< the values are distances if the values of all operands are
};

/// Bound of the distance between the triangulated zero set of a result and the exact surface that
/// the action describes. Away from creases it is `constant` × voxel × (voxel / radius)^(order − 1),
/// where `radius` is the least radius of curvature of that surface. Beside creases it is
/// `creaseConstant` × voxel. `voxel` is the voxel size. The regression suite measures the
/// constants.
struct ErrorModel {
  double order = 1;           ///< order of convergence in the voxel size
  double constant = 0;        ///< factor of the bound away from creases; 0: exact there
  double creaseConstant = 0;  ///< factor beside creases; 0: no new creases
  const char* source = "";    ///< regression case that measured the constants, docs/regression.md
};

// Constants of an ErrorModel for the triangulation of exact distances: kTriangleError on smooth
// surfaces, kCreaseError beside creases. Each is the largest value, rounded up, of the column
// `mesh_linf_vx` in the results.csv of the regression suite's quick runs. On smooth surfaces that
// column is multiplied by radius / voxel. An operator that resamples or moves a surface adds an
// error of about the same size.
inline constexpr double kTriangleError = 0.35;
inline constexpr double kCreaseError = 0.55;

/// Largest difference, in voxels, between a redistanced region of interest and the same region of
/// the redistanced complete band. Redistancing keeps values that are accurate already, so it may
/// keep a value in the region and replace the same value in the complete band.
inline constexpr double kDistanceTolerance = 1e-4;

using Plans = std::span<const ValuePlan>;

/// Plans of an operator's operands and of its complete result.
struct OperatorPlans {
  Plans operands;
  ValuePlan result;
};

/// Information for check(): the options that the user gave, and the kind of the first operand.
struct GivenOptions {
  /// Returns true when the option with this name, without dashes, was given.
  std::function<bool(std::string_view)> isGiven;
  bool isMesh = false;  ///< true: the first operand is a mesh

  [[nodiscard]] bool operator()(std::string_view option) const { return isGiven(option); }
};

/// Figures of an operator for the report of a run, as pairs of key and value.
using Figures =
    std::vector<std::pair<std::string, std::variant<double, std::size_t, bool, std::string>>>;

/// An estimate of the error of a result.
struct ErrorEstimate {
  std::string measure;  ///< name of the quantity, for example "eikonal residual, mean"
  double value = 0;
  std::string unit;  ///< unit of `value`: "" for a pure number, "voxels" or "world units"
};

/// Inputs of a run beside operands and options, and its outputs beside the result.
struct OperatorRun {
  RegionOfInterest roi = {};              ///< part of the result that later operators read
  std::optional<ValuePlan> planned = {};  ///< plan of the complete result; empty: unknown
  bool isPartial = false;  ///< true: the first operand was computed with a reduced half width
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
  /// Drops the caller's references to the operands, to save memory. Afterwards an operator must not
  /// read its mesh operand. Null: the caller needs them.
  std::function<void()> releaseOperands = {};

  std::vector<std::string> notes = {}, warnings = {};
  std::vector<ErrorEstimate> errors = {};
  /// Reason why the result misses a requested tolerance; empty: the result meets the tolerance, or
  /// none was requested.
  std::string failure = {};
  Figures figures = {};      ///< figures for the report of the run
  Figures certificate = {};  ///< sign certificate of a band that was built from a mesh; else empty
};

}  // namespace levelset
