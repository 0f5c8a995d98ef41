#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "apps/pipeline/registry/step_cost.h"
#include "apps/pipeline/values/value.h"
#include "levelset/operator/description.h"
#include "levelset/region_of_interest.h"

/// The registry: one declaration per operator. The command line, help, checks, completion and
/// Python functions are derived from it.
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
  Scalar,    ///< a scalar field: a number, a formula in x, y, z, r, or the @NAME of a value
  Velocity,  ///< a vector field that may depend on time: one of `choices`, three formulas, or the
             ///< @NAME of a field
  Speed,     ///< a normal speed: a formula in x, y, z, r, t, nx, ny, nz, k, or the @NAME of a value
  Mesh,      ///< the @NAME of a mesh
  Solid      ///< the @NAME of a level set
};

using Range = levelset::OptionRange;

struct Param {
  std::string name;  ///< name without the dashes
  ParamType type = ParamType::Number;
  std::string doc;                        ///< one line for the help; the unit follows from `type`
  std::string fallback = {};              ///< default as text; empty: none
  std::vector<std::string> choices = {};  ///< accepted words of a Choice or a Velocity
  Range range = Range::Any;
  bool required = false;
  std::size_t count = 1;  ///< Lengths: number of lengths
  /// Position among the arguments that may be given without a name, from 0; -1: always given as
  /// --NAME.
  int position = -1;
  bool allowsVoxels = true;     ///< Length: may be given in vx
  bool allowsAuto = false;      ///< Length: the word `auto` is accepted too
  std::string formerName = {};  ///< former name of the option, still accepted; empty: none
};

/// Returns the type in words, such as "image size".
[[nodiscard]] const char* typeName(ParamType type);

/// Returns the letter or word that stands for a value in the help, such as "L" for a length.
[[nodiscard]] std::string valueForm(const Param& param);

/// Returns whether a parameter takes the @NAME of a level set for its signed distance.
[[nodiscard]] bool takesDistance(ParamType type);

/// Returns whether the text of the parameter names a value of the chain, "@NAME".
[[nodiscard]] bool namesValue(const Param& param, const std::string& text);

/// Throws UsageError when `text` is not a value of `param`.
/// @param where  begins the message: "action: --name"
void checkText(const Param& param, const std::string& text, const std::string& where);

enum class Flow {
  Makes,         ///< takes its operands off the stack of the chain and pushes its result
  PassesThrough  ///< leaves its operand on the stack, as write, measure, check, info and render do
};

using levelset::Slope;

struct Operator {
  std::string name;
  std::string group;            ///< heading in `help`
  std::string summary;          ///< one line for the help
  std::string details = {};     ///< further sentences of the help page
  std::string example = {};     ///< a complete command line
  std::string formerName = {};  ///< former name of the action, still accepted; empty: none
  std::vector<Param> params = {};
  std::vector<std::vector<Kind>> operands = {};  ///< for each operand, the kinds that it may have
  bool takesMore = false;  ///< more operands may follow, of the kinds of the last one
  /// Without named operands, the action takes the newest value, and if that is a level set, all
  /// level sets directly below it on the stack.
  bool takesStack = false;
  bool operandsOptional = false;  ///< may run without any operand (`info FILE`)
  /// Options with which the action takes its first operand alone.
  std::vector<std::string> aloneWith = {};
  /// Options with which the action takes no operand.
  std::vector<std::string> noneWith = {};
  bool readsNames = false;  ///< the result depends on the names that --as gave to the operands
  /// Returns false if --voxel does not apply to the options and operands, although the action has
  /// it. Empty: it applies.
  std::function<bool(const Invocation&)> takesVoxelSize = {};
  bool isRepeatable = true;  ///< the same operands, options and files give the same result
  Flow flow = Flow::Makes;
  /// Returns the kind of the result before anything runs.
  std::function<Kind(const Invocation&)> resultKind = {};
  std::function<Value(Invocation&)> run = {};
  /// Plans the result before it is computed. Empty: the plan of the first operand is used.
  std::function<Plan(Invocation&)> plan = {};
  /// Estimates the time of `run`, and its memory beside operands and result. Empty: unknown.
  CostOf cost = {};
  /// Bound of the surface error of the result as a function of the voxel size; empty: the
  /// regression suite does not measure it.
  std::optional<levelset::ErrorModel> errorModel = {};
  /// Returns the least radius of curvature of the result, world units; 0 or less: unknown.
  std::function<double(Invocation&)> leastRadius = {};
  Slope slope = Slope::Any;  ///< states if the values of the result are distances
  /// Returns the region of interest of an operand, given that of the result. Empty function:
  /// complete operands are needed. The operands are plans, and Invocation::planned is the plan of
  /// the complete result. Inside its region of interest the result equals that of complete
  /// operands, to the bit or to `partTolerance`.
  std::function<levelset::RegionOfInterest(Invocation&, std::size_t operand,
                                           const levelset::RegionOfInterest& of)>
      regionOfInterest = {};
  /// Largest difference, in voxels, between a value computed on the region of interest and the
  /// complete value.
  double partTolerance = 0;
  /// Number of distance transforms that `run` applies one after another; 0: the result cannot be
  /// computed in parts, although there is a region of interest. Beside the cut of a
  /// region, each changes the last bits of the distances in a further layer of voxels.
  int distancePasses = 1;
  bool makesParts = false;  ///< `run` computes only the region of interest, Invocation::roi
  /// Checks the options and the kinds of the operands before anything runs: options that exclude
  /// each other, formats, missing options.
  std::function<void(const Invocation&)> validate = {};
  /// Returns the files that `run` writes. The pipeline checks before anything runs that it can
  /// create them.
  std::function<std::vector<std::string>(const Invocation&)> targets = {};
  /// Return true if `run` uses standard output, or standard input, for data. With data on standard
  /// output, messages go to standard error.
  std::function<bool(const Invocation&)> usesStandardOutput = {};
  std::function<bool(const Invocation&)> usesStandardInput = {};

  [[nodiscard]] const Param* find(const std::string& param) const;
  /// Returns true if an option of `aloneWith` is given. @param options  values by name
  [[nodiscard]] bool isAlone(const std::map<std::string, std::string>& options) const;
  /// Returns true if an option of `noneWith` is given. @param options  values by name
  [[nodiscard]] bool takesNone(const std::map<std::string, std::string>& options) const;
  /// Number of operands that the action takes without takesMore and operandsOptional.
  [[nodiscard]] std::size_t operandCount(const std::map<std::string, std::string>& options) const {
    return takesNone(options) ? 0 : isAlone(options) ? 1 : operands.size();
  }
};

[[nodiscard]] const std::vector<Operator>& operators();
/// Finds an operator by its name, or by its former name; null: there is none.
[[nodiscard]] const Operator* findOperator(const std::string& name);
/// Finds a parameter by its name, or by its former name; null: there is none.
[[nodiscard]] const Param* findParam(const std::vector<Param>& params, const std::string& name);
/// Returns the message for a former name of an action or option; it gives the new name.
[[nodiscard]] std::string renamedSentence(const std::string& former, const std::string& name);
[[nodiscard]] const std::vector<Param>& globalParams();
/// The action `run FILE`, for help only: parseChain() replaces it by the actions of the file.
[[nodiscard]] const Operator& runOperator();

/// Builds all operators, in the order of the help. apps/pipeline/all_operators.cpp has
/// one line for each.
[[nodiscard]] std::vector<Operator> allOperators();

}  // namespace pipeline
