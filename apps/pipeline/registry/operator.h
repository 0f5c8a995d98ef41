#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/pipeline/registry/cost.h"
#include "apps/pipeline/values/value.h"
#include "levelset/region_of_interest.h"

/// The registry: one declaration per operator. The command line, its help and its checks are made
/// from it.
namespace pipeline {

class Invocation;

enum class ParamType {
  Flag,
  Number,
  Integer,
  Length,
  Lengths,
  Degrees,
  Numbers,
  Point,
  Points,
  Box,
  Matrix,
  Choice,
  Text,
  Path,
  ImageSize,
  Bytes,
  Scalar,   ///< a number in space: a number, a formula in x, y, z, r, or the @NAME of a value
  Velocity  ///< a vector in space and time: one of `choices`, three formulas, or the @NAME of a
            ///< field
};

enum class Range { Any, Positive, NonNegative };

struct Param {
  std::string name;  ///< without the dashes
  ParamType type = ParamType::Number;
  std::string doc;                        ///< one line; the unit is told by the type
  std::string fallback = {};              ///< default as one would write it; empty: none
  std::vector<std::string> choices = {};  ///< of a Choice
  Range range = Range::Any;
  bool required = false;
  std::size_t count = 1;     ///< Lengths: how many, with commas between them
  int position = -1;         ///< ≥ 0: may be given without its name, at this place
  bool allowsVoxels = true;  ///< Length: may it be given in vx?
  bool allowsAuto = false;   ///< Length: `auto` is an answer too
};

/// The type in words, e.g. "image size".
[[nodiscard]] const char* typeName(ParamType type);

/// The form of a value in help, e.g. "L" for a length.
[[nodiscard]] std::string valueForm(const Param& param);

/// Does the parameter name a value of the chain, "@NAME"?
[[nodiscard]] bool namesValue(const Param& param, const std::string& text);

/// Throws UsageError when `text` cannot be a value of `param`. @param where  "action: --name"
void checkText(const Param& param, const std::string& text, const std::string& where);

enum class Flow {
  Makes,         ///< takes its operands off the stack and leaves its result
  PassesThrough  ///< leaves its operand where it is: write, measure, check, info, render
};

/// What is known of the slope of the band that an operator makes.
enum class Slope {
  Any,        ///< it may be no distance
  One,        ///< a distance
  OfOperands  ///< a distance, if all operands are
};

struct Operator {
  std::string name;
  std::string group;         ///< heading in `help`
  std::string summary;       ///< one line
  std::string details = {};  ///< what a user should know beyond the parameters
  std::string example = {};  ///< a whole command line
  std::vector<Param> params = {};
  std::vector<std::vector<Kind>> operands = {};  ///< kinds allowed at each place
  bool takesMore = false;         ///< further operands of the last place's kinds may follow
  bool operandsOptional = false;  ///< may run without any operand (`info FILE`)
  bool readsNames = false;        ///< the result depends on what --as called the operands
  bool isRepeatable = true;       ///< the same operands, options and files give the same result
  Flow flow = Flow::Makes;
  /// Kind of the result, told before anything runs.
  std::function<Kind(const Invocation&)> resultKind = {};
  std::function<Value(Invocation&)> run = {};
  /// What `run` would return, for --dry-run; by default the plan of the first operand.
  std::function<Plan(Invocation&)> plan = {};
  /// What `run` takes beside its operands and its result; without it, nobody knows.
  CostOf cost = {};
  Slope slope = Slope::Any;
  /// The region of interest of an operand, given that of the result; without it, the whole. The
  /// operands are plans, and Invocation::planned is that of the whole result. Inside the part the
  /// result has to be what it is of whole operands, to the bit or to `partTolerance`.
  std::function<levelset::RegionOfInterest(Invocation&, std::size_t operand,
                                           const levelset::RegionOfInterest& of)>
      regionOfInterest = {};
  double partTolerance = 0;  ///< voxels
  bool makesParts = false;   ///< of its operands as they are: `run` keeps to Invocation::roi
  /// Refuses, before anything runs, what can be told from the options and the kinds of the
  /// operands: options that exclude each other, formats, what is missing.
  std::function<void(const Invocation&)> validate = {};
  /// The files that it will write: refused before anything runs when they cannot be made.
  std::function<std::vector<std::string>(const Invocation&)> targets = {};
  /// Does it claim standard output, or input, for data? Text for people goes to standard error
  /// then.
  std::function<bool(const Invocation&)> usesStandardOutput = {};
  std::function<bool(const Invocation&)> usesStandardInput = {};

  [[nodiscard]] const Param* find(const std::string& param) const;
};

[[nodiscard]] const std::vector<Operator>& operators();
[[nodiscard]] const Operator* findOperator(const std::string& name);
[[nodiscard]] const std::vector<Param>& globalParams();
/// `run FILE`, which parseChain() replaces by the actions of the file: for help only.
[[nodiscard]] const Operator& runOperator();

// Each fills its group; see apps/pipeline/operators/.
void addFileOperators(std::vector<Operator>& all);
void addShapeOperators(std::vector<Operator>& all);
void addConversionOperators(std::vector<Operator>& all);
void addSolidOperators(std::vector<Operator>& all);
void addAdvectionOperators(std::vector<Operator>& all);
void addEikonalOperators(std::vector<Operator>& all);
void addFlowOperators(std::vector<Operator>& all);
void addPlacementOperators(std::vector<Operator>& all);
void addPatchOperators(std::vector<Operator>& all);
void addScatterOperators(std::vector<Operator>& all);
void addTextureOperators(std::vector<Operator>& all);
void addAnimationOperators(std::vector<Operator>& all);
void addGeneratorOperators(std::vector<Operator>& all);
void addFoldOperators(std::vector<Operator>& all);
void addInspectionOperators(std::vector<Operator>& all);
void addSceneOperators(std::vector<Operator>& all);
void addSliceOperators(std::vector<Operator>& all);
void addPictureOperators(std::vector<Operator>& all);
void addRegressionOperators(std::vector<Operator>& all);
void addCacheOperators(std::vector<Operator>& all);

}  // namespace pipeline
