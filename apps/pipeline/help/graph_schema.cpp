#include "apps/pipeline/help/graph_schema.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "apps/pipeline/registry/operator.h"

namespace pipeline {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kNumber = R"(\+?-?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?)";

/// Returns a regular expression that matches the accepted texts of a parameter; empty: none.
std::string patternOf(const Param& param) {
  std::string number = kNumber;
  const std::string length = number + (param.allowsVoxels ? "(vx|%)?" : "%?");
  switch (param.type) {
    case ParamType::Number:
    case ParamType::Degrees:
      return number;
    case ParamType::Integer:
      return "-?[0-9]+";
    case ParamType::Length:
      return param.allowsAuto ? "(auto|" + length + ")" : length;
    case ParamType::Lengths:
      return length + fmt::format("(,{}){{{}}}", length, param.count - 1);
    case ParamType::Numbers:
      return number + "((," + number + "){2})?";
    case ParamType::Point:
      return number + "(," + number + "){2}";
    case ParamType::ImageSize:
      return "[0-9]+x[0-9]+";
    case ParamType::Bytes:
      return number + "([KMGTkmgt](i?B)?)?";
    default:
      return "";
  }
}

/// Returns true if a JSON number may be given in place of a text.
bool takesNumber(ParamType type) {
  return type == ParamType::Number || type == ParamType::Degrees || type == ParamType::Length ||
         takesDistance(type) || type == ParamType::Numbers || type == ParamType::Bytes;
}

Json valueSchema(const Param& param) {
  Json json = {{"description", param.doc}};
  if (!param.fallback.empty()) json["default"] = param.fallback;
  if (param.type == ParamType::Flag) {
    json["type"] = "boolean";
    return json;
  }
  if (param.type == ParamType::Choice) {
    json["enum"] = param.choices;
    return json;
  }
  const bool isInteger = param.type == ParamType::Integer;
  if (isInteger || takesNumber(param.type)) {
    json["type"] = {"string", isInteger ? "integer" : "number"};
    // The limits apply to JSON numbers. A pattern checks the form of a text, except for a field.
    if (param.range == Range::Positive) json["exclusiveMinimum"] = 0;
    if (param.range == Range::NonNegative) json["minimum"] = 0;
  } else {
    json["type"] = "string";
  }
  const std::string pattern = patternOf(param);
  if (pattern.empty())
    json["minLength"] = 1;
  else
    json["pattern"] = "^" + pattern + "$";
  return json;
}

/// Schema of a reference to a node: its index in the list of nodes.
Json nodeNumber() {
  return {{"type", "integer"}, {"minimum", 0}};
}

/// Schema of the nodes with a given action.
Json actionSchema(const Operator& op) {
  Json options = Json::object(), named = Json::object(), required = Json::array();
  for (const Param& param : op.params) {
    options[param.name] = valueSchema(param);
    if (namesValue(param, "@")) named[param.name] = nodeNumber();
    if (param.required && !namesValue(param, "@")) required.push_back(param.name);
  }
  Json inputs = {{"type", "array"}, {"items", nodeNumber()}};
  if (!op.takesMore) inputs["maxItems"] = op.operands.size();
  if (!op.operandsOptional)
    inputs["minItems"] = !op.noneWith.empty() ? 0 : op.aloneWith.empty() ? op.operands.size() : 1;
  Json properties = {{"op", {{"const", op.name}}},
                     {"options",
                      {{"type", "object"},
                       {"properties", options},
                       {"required", required},
                       {"additionalProperties", false}}},
                     {"inputs", inputs}};
  if (!named.empty()) {
    properties["named"] = {
        {"type", "object"}, {"properties", named}, {"additionalProperties", false}};
  }
  if (op.flow == Flow::Makes) properties["as"] = {{"type", "string"}, {"minLength", 1}};
  Json needed = {"op"};
  if (!required.empty()) needed.push_back("options");
  if (!op.operands.empty() && !op.operandsOptional && op.noneWith.empty())
    needed.push_back("inputs");
  return {{"description", op.summary},
          {"type", "object"},
          {"properties", properties},
          {"required", needed},
          {"additionalProperties", false}};
}

/// Schema of --tolerance, the only global option that a graph file contains.
Json toleranceSchema() {
  for (const Param& param : globalParams())
    if (param.name == "tolerance") return valueSchema(param);
  return Json::object();
}

}  // namespace

std::string graphSchema() {
  Json names = Json::array(), cases = Json::array(), actions = Json::object();
  for (const Operator& op : operators()) {
    names.push_back(op.name);
    actions[op.name] = actionSchema(op);
    cases.push_back({{"if", {{"properties", {{"op", {{"const", op.name}}}}}}},
                     {"then", {{"$ref", "#/$defs/" + op.name}}}});
  }
  // The member `op` of a node selects its schema, so that validation errors name only that action.
  const Json node = {{"type", "object"},
                     {"properties", {{"op", {{"enum", names}}}}},
                     {"required", {"op"}},
                     {"allOf", cases}};
  const Json schema = {
      {"$schema", "https://json-schema.org/draft/2020-12/schema"},
      {"title", "levelsmith graph"},
      {"description",
       "Actions with their options and operands. An operand is the index of an earlier node; the "
       "first node has index 0. Option values are texts as on the command line; numeric ones may "
       "be JSON numbers."},
      {"type", "object"},
      {"properties",
       {{"format", {{"const", "levelsmith graph"}}},
        {"version", {{"const", 1}}},
        {"tolerance", toleranceSchema()},
        {"nodes", {{"type", "array"}, {"minItems", 1}, {"items", node}}}}},
      {"required", {"format", "version", "nodes"}},
      {"$defs", actions}};
  return schema.dump(2) + "\n";
}

}  // namespace pipeline
