// JSON Schema of graphs: it accepts all input that the reader accepts, and refuses errors that a
// schema can express.

#include "apps/pipeline/help/graph_schema.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>

#include "apps/pipeline/grammar/chain.h"
#include "apps/pipeline/grammar/script_words.h"
#include "apps/pipeline/graph/graph_file.h"

namespace graph_schema_test {

using Json = nlohmann::json;

/// The subset of draft 2020-12 that the schema uses.
class Validator {
 public:
  explicit Validator(Json schema) : root_(std::move(schema)) {}
  [[nodiscard]] bool takes(const Json& value) const { return takes(root_, value); }

 private:
  [[nodiscard]] bool takes(const Json& schema, const Json& value) const {
    for (const auto& [word, rule] : schema.items())
      if (!obeys(word, rule, schema, value)) return false;
    return true;
  }

  [[nodiscard]] bool obeys(const std::string& word, const Json& rule, const Json& schema,
                           const Json& value) const {
    const auto all = [](const Json& list, const auto& test) {
      return std::all_of(list.begin(), list.end(), test);
    };
    if (word == "$ref")
      return takes(root_.at(Json::json_pointer(rule.get<std::string>().substr(1))), value);
    if (word == "type")
      return rule.is_array() ? std::any_of(rule.begin(), rule.end(),
                                           [&](const Json& type) { return isOf(type, value); })
                             : isOf(rule, value);
    if (word == "const") return value == rule;
    if (word == "enum") return std::find(rule.begin(), rule.end(), value) != rule.end();
    if (word == "pattern")
      return !value.is_string() ||
             std::regex_search(value.get<std::string>(), std::regex(rule.get<std::string>()));
    if (word == "minLength") return !value.is_string() || value.get<std::string>().size() >= rule;
    if (word == "minimum") return !value.is_number() || value >= rule;
    if (word == "exclusiveMinimum") return !value.is_number() || value > rule;
    if (word == "minItems") return !value.is_array() || value.size() >= rule;
    if (word == "maxItems") return !value.is_array() || value.size() <= rule;
    if (word == "items")
      return !value.is_array() || all(value, [&](const Json& v) { return takes(rule, v); });
    if (word == "required")
      return all(rule, [&](const Json& name) { return value.contains(name.get<std::string>()); });
    if (word == "properties") {
      for (const auto& [name, each] : rule.items())
        if (value.contains(name) && !takes(each, value[name])) return false;
      return true;
    }
    if (word == "additionalProperties") {
      EXPECT_EQ(rule, false);
      for (const auto& [name, each] : value.items())
        if (!schema["properties"].contains(name)) return false;
      return true;
    }
    if (word == "allOf") return all(rule, [&](const Json& each) { return takes(each, value); });
    if (word == "if") return !takes(rule, value) || takes(schema["then"], value);
    EXPECT_TRUE(word == "then" || word == "description" || word == "default" || word == "title" ||
                word == "$schema" || word == "$defs")
        << word;
    return true;
  }

  static bool isOf(const std::string& type, const Json& value) {
    if (type == "object") return value.is_object();
    if (type == "array") return value.is_array();
    if (type == "string") return value.is_string();
    if (type == "boolean") return value.is_boolean();
    if (type == "integer") return value.is_number_integer();
    EXPECT_EQ(type, "number");
    return value.is_number();
  }

  Json root_;
};

const Validator& schema() {
  static const Validator validator(Json::parse(pipeline::graphSchema()));
  return validator;
}

Json graphOf(Json nodes) {
  return {{"format", "levelsmith graph"}, {"version", 1}, {"nodes", std::move(nodes)}};
}

/// A graph of the action with these options, after enough balls for its operands.
bool takesOptions(const std::string& op, const Json& options) {
  return schema().takes(graphOf({{{"op", op}, {"options", options}, {"inputs", Json::array()}}}));
}

TEST(GraphSchema, AcceptsEveryExample) {
  for (const auto& op : pipeline::operators()) {
    if (op.example.find("<(") != std::string::npos) continue;  // syntax of the shell
    std::vector<std::string> words;
    for (const auto& line : pipeline::splitScript(op.example, op.name))
      for (const auto& word : line.words)
        for (std::string& text = words.emplace_back(); const auto& part : word) text += part.text;
    words.erase(words.begin());
    const auto graph = pipeline::parseChain(words);
    EXPECT_TRUE(schema().takes(Json::parse(pipeline::graphJson(graph)))) << op.example;
  }
}

TEST(GraphSchema, AcceptsDefaultsAndForms) {
  for (const auto& op : pipeline::operators()) {
    const Json node =
        Json::parse(pipeline::graphSchema())["$defs"][op.name]["properties"]["options"];
    for (const auto& param : op.params) {
      if (param.fallback.empty() || param.type == pipeline::ParamType::Flag) continue;
      const Json& property = node["properties"][param.name];
      const std::string pattern = property.value("pattern", "");
      EXPECT_TRUE(std::regex_search(param.fallback, std::regex(pattern)))
          << op.name << " --" << param.name << " " << param.fallback << " " << pattern;
    }
  }
  const auto sphere = [](const Json& radius) {
    return takesOptions("sphere", {{"radius", radius}, {"voxel", 0.1}});
  };
  for (const char* text : {"1", "1.", ".5", "2e-3", "+1", "1%", "2vx"})
    EXPECT_TRUE(sphere(text)) << text;
  EXPECT_TRUE(sphere(1.5));
  for (const char* text : {"", "much", "2cm", "1,5", "0x10", "1 "})
    EXPECT_FALSE(sphere(text)) << text;
  EXPECT_FALSE(sphere(0));
  EXPECT_FALSE(sphere(true));
  EXPECT_FALSE(takesOptions("sphere", {{"radius", "1"}, {"voxel", "2vx"}}));
}

TEST(GraphSchema, RefusesGraphsThatTheReaderRefuses) {
  const Json ball = {{"op", "sphere"}, {"options", {{"radius", "1"}, {"voxel", "0.1"}}}};
  EXPECT_TRUE(schema().takes(graphOf({ball})));
  EXPECT_FALSE(schema().takes(graphOf(Json::array())));
  EXPECT_FALSE(schema().takes({{"version", 1}, {"nodes", {ball}}}));
  EXPECT_FALSE(schema().takes(graphOf({{{"op", "spere"}}})));
  EXPECT_FALSE(schema().takes(graphOf({{{"op", "sphere"}}})));  // without a radius
  EXPECT_FALSE(takesOptions("sphere", {{"radius", "1"}, {"raduis", "1"}}));
  const auto behind = [&](const Json& node) { return schema().takes(graphOf({ball, node})); };
  EXPECT_TRUE(behind({{"op", "measure"}, {"inputs", {0}}, {"options", {{"json", true}}}}));
  EXPECT_FALSE(behind({{"op", "measure"}, {"inputs", {0}}, {"options", {{"json", "yes"}}}}));
  EXPECT_FALSE(behind({{"op", "measure"}, {"inputs", {0}}, {"as", "m"}}));  // has no result
  EXPECT_FALSE(behind({{"op", "measure"}}));
  EXPECT_FALSE(behind({{"op", "measure"}, {"inputs", {0, 0}}}));
  EXPECT_TRUE(behind({{"op", "union"}, {"inputs", {0, 0, 0}}, {"as", "u"}}));
  EXPECT_FALSE(behind({{"op", "union"}, {"inputs", {-1, 0}}}));
  EXPECT_TRUE(behind({{"op", "smooth"},
                      {"options", {{"sigma", "1vx"}}},
                      {"inputs", {0}},
                      {"named", {{"mask", 0}}}}));
  EXPECT_FALSE(behind({{"op", "smooth"},
                       {"options", {{"sigma", "1vx"}}},
                       {"inputs", {0}},
                       {"named", {{"sigma", 0}}}}));
}

}  // namespace graph_schema_test
