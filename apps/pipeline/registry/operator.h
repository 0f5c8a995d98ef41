#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/pipeline/registry/step_cost.h"
#include "apps/pipeline/values/value.h"
#include "levelset/operator/description.h"
#include "levelset/region_of_interest.h"

/// The registry: one declaration per operator. Command line, help, checks, completion and Python
/// functions follow from it.
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

using Range = levelset::OptionRange;

struct Param {
  std::string name;  ///< without the dashes
  ParamType type = ParamType::Number;
  std::string doc;                        ///< one line; the type gives the unit
  std::string fallback = {};              ///< default as text; empty: none
  std::vector<std::string> choices = {};  ///< values of a Choice
  Range range = Range::Any;
  bool required = false;
  std::size_t count = 1;        ///< Lengths: their number
  int position = -1;            ///< ≥ 0: place at which it may stand without its name
  bool allowsVoxels = true;     ///< Length: may be given in vx
  bool allowsAuto = false;      ///< Length: `auto` is a value, too
  std::string formerName = {};  ///< a name that scripts used before; it keeps working
};

/// Returns the type in words, such as "image size".
[[nodiscard]] const char* typeName(ParamType type);

/// Returns the form of a value in the help, such as "L" for a length.
[[nodiscard]] std::string valueForm(const Param& param);

/// Returns whether the text of the parameter names a value of the chain, "@NAME".
[[nodiscard]] bool namesValue(const Param& param, const std::string& text);

/// Throws UsageError when `text` is not a value of `param`.
/// @param where  "action: --name"
void checkText(const Param& param, const std::string& text, const std::string& where);

enum class Flow {
  Makes,         ///< takes its operands off the stack and leaves its result
  PassesThrough  ///< leaves its operand on the stack: write, measure, check, info, render
};

using levelset::Slope;

struct Operator {
  std::string name;
  std::string group;            ///< heading in `help`
  std::string summary;          ///< one line
  std::string details = {};     ///< facts beyond the parameters
  std::string example = {};     ///< a complete command line
  std::string formerName = {};  ///< a name that scripts used before; it keeps working
  std::vector<Param> params = {};
  std::vector<std::vector<Kind>> operands = {};  ///< kinds allowed at each place
  bool takesMore = false;         ///< further operands of the last place's kinds may follow
  bool operandsOptional = false;  ///< may run without any operand (`info FILE`)
  bool readsNames = false;        ///< the result depends on what --as called the operands
  bool isRepeatable = true;       ///< the same operands, options and files give the same result
  Flow flow = Flow::Makes;
  /// Kind of the result, known before anything runs.
  std::function<Kind(const Invocation&)> resultKind = {};
  std::function<Value(Invocation&)> run = {};
  /// Plan of the result, for --dry-run; by default that of the first operand.
  std::function<Plan(Invocation&)> plan = {};
  /// Cost of `run`, beside operands and result; empty: not known.
  CostOf cost = {};
  std::optional<levelset::ErrorModel> errorModel = {};
  /// Least radius of curvature of the result, world units; not positive: not known.
  std::function<double(Invocation&)> leastRadius = {};
  Slope slope = Slope::Any;
  /// Region of interest of an operand, given that of the result. Empty: complete operands are
  /// needed. The operands are plans, and Invocation::planned is the plan of the complete result.
  /// Inside its region of interest the result equals that of complete operands, to the bit or to
  /// `partTolerance`.
  std::function<levelset::RegionOfInterest(Invocation&, std::size_t operand,
                                           const levelset::RegionOfInterest& of)>
      regionOfInterest = {};
  double partTolerance = 0;  ///< voxels
  bool makesParts = false;   ///< `run` makes only the part in Invocation::roi
  /// Checks, before anything runs, the options and the kinds of the operands: options that exclude
  /// each other, formats, missing options.
  std::function<void(const Invocation&)> validate = {};
  /// Files that `run` writes. The pipeline checks before anything runs that it can create them.
  std::function<std::vector<std::string>(const Invocation&)> targets = {};
  /// Whether `run` uses standard output, or input, for data. Messages then go to standard error.
  std::function<bool(const Invocation&)> usesStandardOutput = {};
  std::function<bool(const Invocation&)> usesStandardInput = {};

  [[nodiscard]] const Param* find(const std::string& param) const;
};

[[nodiscard]] const std::vector<Operator>& operators();
/// Finds an operator by its name, or by its former name; null: there is none.
[[nodiscard]] const Operator* findOperator(const std::string& name);
/// Finds a parameter by its name, or by its former name; null: there is none.
[[nodiscard]] const Param* findParam(const std::vector<Param>& params, const std::string& name);
/// Sentence that names the new word for a former one.
[[nodiscard]] std::string renamedSentence(const std::string& former, const std::string& name);
[[nodiscard]] const std::vector<Param>& globalParams();
/// The action `run FILE`, for help only: parseChain() replaces it by the actions of the file.
[[nodiscard]] const Operator& runOperator();

/// Builds all operators, in the order of the help. apps/pipeline/all_operators.cpp has
/// one line for each.
[[nodiscard]] std::vector<Operator> allOperators();

}  // namespace pipeline
