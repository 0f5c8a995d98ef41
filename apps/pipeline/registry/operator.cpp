#include "apps/pipeline/registry/operator.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/pipeline/values/units.h"
#include "levelset/error.h"
#include "levelset/fields/expression.h"

namespace pipeline {

using levelset::UsageError;

const char* typeName(ParamType type) {
  switch (type) {
    case ParamType::Flag:
      return "flag";
    case ParamType::Number:
      return "number";
    case ParamType::Integer:
      return "integer";
    case ParamType::Length:
      return "length";
    case ParamType::Lengths:
      return "lengths";
    case ParamType::Degrees:
      return "degrees";
    case ParamType::Numbers:
      return "numbers";
    case ParamType::Point:
      return "point";
    case ParamType::Points:
      return "points";
    case ParamType::Box:
      return "box";
    case ParamType::Matrix:
      return "matrix";
    case ParamType::Choice:
      return "choice";
    case ParamType::Text:
      return "text";
    case ParamType::Path:
      return "path";
    case ParamType::ImageSize:
      return "image size";
    case ParamType::Bytes:
      return "bytes";
    case ParamType::Scalar:
      return "scalar field";
    case ParamType::Velocity:
      return "velocity";
    case ParamType::Speed:
      return "speed";
    case ParamType::Mesh:
      return "mesh";
    case ParamType::Solid:
      return "level set";
  }
  return "";
}

std::string valueForm(const Param& param) {
  switch (param.type) {
    case ParamType::Flag:
      return "";
    case ParamType::Number:
      return "X";
    case ParamType::Integer:
      return "N";
    case ParamType::Length:
      return "L";
    case ParamType::Lengths:
      return param.count == 2 ? "L,L" : "L,L,L";
    case ParamType::Degrees:
      return "DEG";
    case ParamType::Numbers:
      return "X|X,Y,Z";
    case ParamType::Point:
      return "x,y,z";
    case ParamType::Points:
      return "\"x,y,z …\"";
    case ParamType::Box:
      return "\"lo hi\"";
    case ParamType::Matrix:
      return "\"m00 m01 …\"";
    case ParamType::Choice:
      return fmt::format("{}", fmt::join(param.choices, "|"));
    case ParamType::Text:
      return "TEXT";
    case ParamType::Path:
      return "FILE";
    case ParamType::ImageSize:
      return "WxH";
    case ParamType::Bytes:
      return "SIZE";
    case ParamType::Scalar:
    case ParamType::Speed:
      return "X|FORMULA|@NAME";
    case ParamType::Velocity:
      return fmt::format("{}|\"FX, FY, FZ\"|@NAME", fmt::join(param.choices, "|"));
    case ParamType::Mesh:
    case ParamType::Solid:
      return "@NAME";
  }
  return "";
}

namespace {

void checkRange(const Param& param, double number, const std::string& text,
                const std::string& where) {
  if (param.range == Range::Positive && !(number > 0))
    throw UsageError(fmt::format("{}: '{}' must be positive", where, text));
  if (param.range == Range::NonNegative && !(number >= 0))
    throw UsageError(fmt::format("{}: '{}' must not be negative", where, text));
}

void checkField(const Param& param, const std::string& text, const std::string& where) {
  if (text == "@") throw UsageError(fmt::format("{}: a name must follow '@'", where));
  if (namesValue(param, text)) return;
  if (param.type == ParamType::Mesh || param.type == ParamType::Solid)
    throw UsageError(
        fmt::format("{}: '{}' is not the name of a {}; name one with --as NAME and write @NAME",
                    where, text, typeName(param.type)));
  const auto& known = param.choices;
  if (std::find(known.begin(), known.end(), text) != known.end()) return;
  levelset::withContext(where, [&] {
    if (param.type == ParamType::Scalar)
      (void)levelset::scalarExpression(text);
    else if (param.type == ParamType::Speed)
      (void)levelset::speedExpression(text);
    else
      (void)levelset::vectorExpression(text);
  });
}

}  // namespace

bool takesDistance(ParamType type) {
  return type == ParamType::Scalar || type == ParamType::Speed;
}

bool namesValue(const Param& param, const std::string& text) {
  return (takesDistance(param.type) || param.type == ParamType::Velocity ||
          param.type == ParamType::Mesh || param.type == ParamType::Solid) &&
         text.starts_with('@');
}

void checkText(const Param& param, const std::string& text, const std::string& where) {
  switch (param.type) {
    case ParamType::Flag:
      return;
    case ParamType::Number:
    case ParamType::Degrees:
      return checkRange(param, parseNumber(text, where), text, where);
    case ParamType::Integer:
      return checkRange(param, static_cast<double>(parseInteger(text, where)), text, where);
    case ParamType::Length: {
      if (param.allowsAuto && text == "auto") return;
      const Length length = parseLength(text, where);
      if (length.unit == Unit::Voxels && !param.allowsVoxels && param.name != "voxel") {
        throw UsageError(fmt::format(
            "{}: the length determines the voxel size, so it cannot be given in voxels; "
            "write it in world units, or as a share of the diagonal, 0.2%",
            where));
      }
      if (length.unit == Unit::Voxels && !param.allowsVoxels) {
        throw UsageError(
            fmt::format("{}: a voxel size cannot be given in voxels; write it in world units, "
                        "or use --resolution",
                        where));
      }
      return checkRange(param, length.number, text, where);
    }
    case ParamType::Lengths:
      for (const Length& length : parseLengths(text, param.count, where))
        checkRange(param, length.number, text, where);
      return;
    case ParamType::Numbers:
      for (double number : parseNumbers(text, where)) checkRange(param, number, text, where);
      return;
    case ParamType::Point:
      for (int axis = 0; axis < 3; ++axis)
        checkRange(param, parsePoint(text, where)[axis], text, where);
      return;
    case ParamType::Points:
      return void(parsePoints(text, where));
    case ParamType::Box:
      return void(parseBox(text, where));
    case ParamType::Matrix:
      return void(parseMatrix(text, where));
    case ParamType::Choice:
      if (std::find(param.choices.begin(), param.choices.end(), text) == param.choices.end()) {
        throw UsageError(
            fmt::format("{}: '{}' is not one of {}", where, text, fmt::join(param.choices, ", ")));
      }
      return;
    case ParamType::Text:
    case ParamType::Path:
      if (text.empty()) throw UsageError(fmt::format("{}: the value is empty; give one", where));
      return;
    case ParamType::ImageSize:
      return void(parseImageSize(text, where));
    case ParamType::Bytes:
      return void(parseBytes(text, where));
    case ParamType::Scalar:
    case ParamType::Velocity:
    case ParamType::Speed:
    case ParamType::Mesh:
    case ParamType::Solid:
      return checkField(param, text, where);
  }
}

namespace {

bool hasAny(const std::map<std::string, std::string>& options,
            const std::vector<std::string>& names) {
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& name) { return options.contains(name); });
}

}  // namespace

bool Operator::isAlone(const std::map<std::string, std::string>& options) const {
  return hasAny(options, aloneWith);
}

bool Operator::takesNone(const std::map<std::string, std::string>& options) const {
  return hasAny(options, noneWith);
}

const Param* Operator::find(const std::string& param) const {
  const auto it =
      std::find_if(params.begin(), params.end(), [&](const Param& p) { return p.name == param; });
  return it == params.end() ? nullptr : &*it;
}

const std::vector<Operator>& operators() {
  static const std::vector<Operator> all = allOperators();
  return all;
}

const Operator* findOperator(const std::string& name) {
  const auto find = [&](std::string Operator::*word) {
    const auto it = std::find_if(operators().begin(), operators().end(),
                                 [&](const Operator& op) { return op.*word == name; });
    return it == operators().end() ? nullptr : &*it;
  };
  if (name.empty()) return nullptr;
  const Operator* op = find(&Operator::name);
  return op ? op : find(&Operator::formerName);
}

const Param* findParam(const std::vector<Param>& params, const std::string& name) {
  const auto find = [&](std::string Param::*word) {
    const auto it =
        std::find_if(params.begin(), params.end(), [&](const Param& p) { return p.*word == name; });
    return it == params.end() ? nullptr : &*it;
  };
  if (name.empty()) return nullptr;
  const Param* param = find(&Param::name);
  return param ? param : find(&Param::formerName);
}

std::string renamedSentence(const std::string& former, const std::string& name) {
  return "'" + former + "' is now '" + name + "'; the old word keeps working";
}

const Operator& runOperator() {
  static const Operator op{
      .name = "run",
      .group = "Chains in files",
      .summary = "run a file: a chain, one action a line, or a graph (.json)",
      .details =
          "The file has one action on each line, without '!'. # begins a comment; quotes and "
          "backslashes work as in a shell. Lines of options before the first action are global "
          "options; options of the command line override them. ${NAME} is a variable: a line `set "
          "NAME VALUE` gives its default, --set gives another value; ${NAME:stem}, ${NAME:name} "
          "and ${NAME:dir} are parts of a file name. Actions between `repeat COUNT` (which counts "
          "${i} from 0) or `for NAME in LIST` and `end` are repeated; a LIST is words, 0..10, 0..1 "
          "step 0.25, or *.ply. A .json file is a graph that --save-graph wrote. No action may "
          "follow the file.",
      .example = "levelsmith --threads 2 run holes.pipeline --set voxel=0.3",
      .params = {{.name = "file",
                  .type = ParamType::Path,
                  .doc = "file to run, or -",
                  .required = true,
                  .position = 0},
                 {.name = "set",
                  .type = ParamType::Text,
                  .doc = "value of a variable of the file, as NAME=VALUE; may be repeated"}},
      .flow = Flow::PassesThrough};
  return op;
}

const std::vector<Param>& globalParams() {
  static const std::vector<Param> params = {
      {.name = "threads",
       .type = ParamType::Integer,
       .doc = "number of threads; results do not depend on it",
       .range = Range::Positive},
      {.name = "max-memory",
       .type = ParamType::Bytes,
       .doc = "memory limit, e.g. 4G; an action that needs more fails; default: 80 % of the free "
              "memory"},
      {.name = "tolerance",
       .type = ParamType::Length,
       .doc =
           "largest accepted error of the results; determines the voxel sizes that are not given",
       .range = Range::Positive,
       .allowsVoxels = false},
      {.name = "quiet", .type = ParamType::Flag, .doc = "print errors only"},
      {.name = "verbose",
       .type = ParamType::Flag,
       .doc = "print time, memory and voxels of each step (also -v)"},
      {.name = "report",
       .type = ParamType::Path,
       .doc = "file for the result and the cost of each step: .json, or .html for a page with "
              "pictures"},
      {.name = "save-graph",
       .type = ParamType::Path,
       .doc = "file for the graph, a .json that `run` reads; with --dry-run nothing else is done"},
      {.name = "no-roi",
       .type = ParamType::Flag,
       .doc = "compute every value completely, also where a part of it suffices",
       .formerName = "whole"},
      {.name = "cache",
       .type = ParamType::Path,
       .doc = "folder that stores results; a stored result is not computed again"},
      {.name = "progress",
       .type = ParamType::Choice,
       .doc = "progress display: auto (bars on a terminal), json (lines of JSON) or off",
       .fallback = "auto",
       .choices = {"auto", "json", "off"}},
      {.name = "no-clobber", .type = ParamType::Flag, .doc = "never overwrite a file"},
      {.name = "explain",
       .type = ParamType::Flag,
       .doc = "list the actions that would run or be left out, with the reason, the region of "
              "interest of each value, and the estimated cost; computes and writes nothing"},
      {.name = "dry-run",
       .type = ParamType::Flag,
       .doc = "resolve every parameter and estimate the cost; computes and writes nothing"},
  };
  return params;
}

}  // namespace pipeline
