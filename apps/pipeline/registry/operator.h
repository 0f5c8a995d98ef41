#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/pipeline/registry/cost.h"
#include "apps/pipeline/values/value.h"
#include "levelset/operator/description.h"
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

using Range = levelset::OptionRange;

struct Param {
  std::string name;  ///< without the dashes
  ParamType type = ParamType::Number;
  std::string doc;                        ///< one line; the unit is told by the type
  std::string fallback = {};              ///< default as one would write it; empty: none
  std::vector<std::string> choices = {};  ///< of a Choice
  Range range = Range::Any;
  bool required = false;
  std::size_t count = 1;        ///< Lengths: how many, with commas between them
  int position = -1;            ///< ≥ 0: may be given without its name, at this place
  bool allowsVoxels = true;     ///< Length: may it be given in vx?
  bool allowsAuto = false;      ///< Length: `auto` is an answer too
  std::string formerName = {};  ///< a name that scripts used before; it keeps working
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

using levelset::Slope;

struct Operator {
  std::string name;
  std::string group;            ///< heading in `help`
  std::string summary;          ///< one line
  std::string details = {};     ///< what a user should know beyond the parameters
  std::string example = {};     ///< a whole command line
  std::string formerName = {};  ///< a name that scripts used before; it keeps working
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
  std::optional<levelset::ErrorModel> errorModel = {};
  /// Least radius of curvature of the result, world units; not positive where options do not tell.
  std::function<double(Invocation&)> leastRadius = {};
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
/// Finds an operator by its name, or by its former name; null: there is none.
[[nodiscard]] const Operator* findOperator(const std::string& name);
/// Finds a parameter by its name, or by its former name; null: there is none.
[[nodiscard]] const Param* findParam(const std::vector<Param>& params, const std::string& name);
/// The sentence that names the new word for a former one.
[[nodiscard]] std::string renamedSentence(const std::string& former, const std::string& name);
[[nodiscard]] const std::vector<Param>& globalParams();
/// `run FILE`, which parseChain() replaces by the actions of the file: for help only.
[[nodiscard]] const Operator& runOperator();

/// One line per operator, in the order of the help: apps/pipeline/operators/all_operators.cpp.
[[nodiscard]] std::vector<Operator> allOperators();

}  // namespace pipeline
