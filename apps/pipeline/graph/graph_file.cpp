#include "apps/pipeline/graph/graph_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "apps/pipeline/values/text_file.h"
#include "levelset/error.h"
#include "levelset/files/json_text.h"

namespace pipeline {
namespace {

using Json = nlohmann::ordered_json;
using levelset::InvalidInput;
using levelset::UsageError;

constexpr const char* kFormat = "levelsmith graph";
constexpr const char* kTolerance = "tolerance";
constexpr int kVersion = 1;
constexpr std::size_t kMostBytes = 1 << 25;

Json toJson(const Node& node) {
  Json json = {{"op", node.op->name}};
  for (const auto& [option, text] : node.options) {
    if (node.named.contains(option)) continue;
    const Param* param = node.op->find(option);
    if (param && param->type == ParamType::Flag)
      json["options"][option] = true;
    else
      json["options"][option] = text;
  }
  if (!node.inputs.empty()) json["inputs"] = node.inputs;
  for (const auto& [option, number] : node.named) json["named"][option] = number;
  if (!node.name.empty()) json["as"] = node.name;
  return json;
}

/// Reads the nodes of a JSON graph one by one. Each error message names the node by its index.
class GraphReader {
 public:
  GraphReader(const Json& nodes, std::string file, std::map<std::string, std::string> globals)
      : all_(nodes), file_(std::move(file)) {
    graph_.globals = std::move(globals);
  }

  Graph read() {
    for (at_ = 0; at_ < all_.size(); ++at_) {
      try {
        readNode(all_[at_]);
      } catch (const UsageError& error) {
        throw UsageError(fmt::format("{} ({}, node {})", error.what(), file_, at_));
      }
    }
    return std::move(graph_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw InvalidInput(fmt::format("run: '{}', node {}: {}", file_, at_, what));
  }

  void readNode(const Json& json) {
    if (!json.is_object()) refuse("the node is not an object; write {\"op\": ...}");
    for (const auto& [key, value] : json.items())
      if (key != "op" && key != "options" && key != "inputs" && key != "named" && key != "as")
        refuse(fmt::format(
            "the node has an unknown member '{}'; use op, options, inputs, named and as", key));
    Node node;
    const std::string op = textOf(json, "op");
    node.op = findOperator(op);
    if (node.op) graph_.addRenamed(op, node.op->name);
    if (!node.op)
      throw UsageError(
          fmt::format("run: there is no action '{}'; `levelsmith help` lists them", op));
    readOptions(json, node);
    if (json.contains("inputs")) {
      if (!json["inputs"].is_array()) refuse("'inputs' is not a list; write [0, 1]");
      for (const Json& input : json["inputs"]) node.inputs.push_back(numberOf(input));
    }
    readNamed(json, node);
    for (const Param& param : node.op->params)
      if (param.required && !node.options.contains(param.name))
        throw UsageError(fmt::format("{}: needs {} {}", op, param.name, valueForm(param)));
    if (json.contains("as")) setName(textOf(json, "as"), node);
    if (graph_.globals.contains(kTolerance)) leaveVoxelOpen(node, graph_.nodes);
    node.kind = checkNode(node, graph_.nodes);
    graph_.nodes.push_back(std::move(node));
  }

  void readOptions(const Json& json, Node& node) {
    if (!json.contains("options")) return;
    const Json& options = json["options"];
    if (!options.is_object()) refuse("'options' is not an object; write {\"radius\": \"1\"}");
    for (const auto& [name, value] : options.items()) {
      const Param& param = paramOf(node, name);
      const std::string where = node.op->name + ": --" + param.name;
      if (param.type == ParamType::Flag) {
        if (!value.is_boolean()) refuse(fmt::format("--{} is a flag; write true", name));
        if (value.get<bool>()) node.options[param.name] = "true";
        continue;
      }
      std::string text;
      if (value.is_string())
        text = value.get<std::string>();
      else if (value.is_number())
        text = value.dump();
      else
        refuse(fmt::format("--{} is neither a text nor a number; write \"1\" or 1", name));
      if (namesValue(param, text))
        throw UsageError(fmt::format(
            "{}: '{}' names a value; give the number of its node under \"named\"", where, text));
      checkText(param, text, where);
      node.options[param.name] = text;
    }
  }

  void readNamed(const Json& json, Node& node) {
    if (!json.contains("named")) return;
    const Json& named = json["named"];
    if (!named.is_object()) refuse("'named' is not an object; write {\"mask\": 0}");
    for (const auto& [name, value] : named.items()) {
      const Param& param = paramOf(node, name);
      const std::size_t number = numberOf(value);
      const std::string& known = graph_.nodes[number].name;
      const std::string text = "@" + (known.empty() ? fmt::format("{}", number) : known);
      if (!namesValue(param, text))
        throw UsageError(
            fmt::format("{}: --{} takes no value of another action; give it under \"options\"",
                        node.op->name, name));
      if (node.options.contains(param.name))
        throw UsageError(
            fmt::format("{}: --{} is given twice; leave one out", node.op->name, name));
      node.options[param.name] = text;
      node.named[param.name] = number;
    }
  }

  void setName(const std::string& name, Node& node) {
    if (!node.makes())
      throw UsageError(
          fmt::format("{}: the action has no result to name; leave out \"as\"", node.op->name));
    if (name.empty() || !names_.emplace(name, at_).second)
      throw UsageError(
          fmt::format("{}: the name '{}' is taken or empty; choose another", node.op->name, name));
    node.name = name;
  }

  [[nodiscard]] const Param& paramOf(const Node& node, const std::string& name) {
    if (const Param* param = findParam(node.op->params, name)) {
      if (param->name != name) graph_.addRenamed("--" + name, "--" + param->name);
      return *param;
    }
    throw UsageError(fmt::format("{}: there is no option --{}; `levelsmith help {}` lists them",
                                 node.op->name, name, node.op->name));
  }
  [[nodiscard]] std::string textOf(const Json& json, const char* key) const {
    if (!json.contains(key) || !json[key].is_string())
      refuse(fmt::format("the node has no member '{}' that is a text; add it", key));
    return json[key].get<std::string>();
  }
  /// Reads the index of an operand. Checks that it is an earlier node with a result.
  [[nodiscard]] std::size_t numberOf(const Json& json) const {
    if (!json.is_number_unsigned() || json.get<std::uint64_t>() >= at_)
      refuse(
          fmt::format("the node refers to {}; give the number of an earlier node, the first is 0",
                      json.dump(-1, ' ', false, Json::error_handler_t::replace)));
    const auto number = json.get<std::size_t>();
    if (!graph_.nodes[number].makes())
      refuse(fmt::format(
          "the node takes node {} as operand, but '{}' has no result; take another node", number,
          graph_.nodes[number].op->name));
    return number;
  }

  const Json& all_;
  std::string file_;
  Graph graph_;
  std::map<std::string, std::size_t> names_;
  std::size_t at_ = 0;
};

std::string toleranceText(const Json& json, const std::string& file) {
  if (!json.is_string() && !json.is_number())
    throw InvalidInput(fmt::format(
        "run: '{}': \"tolerance\" is neither a text nor a number; write \"1%\" or 0.01", file));
  std::string text = json.is_string() ? json.get<std::string>() : json.dump();
  const std::vector<Param>& all = globalParams();
  const auto param = std::find_if(all.begin(), all.end(),
                                  [](const Param& known) { return known.name == kTolerance; });
  checkText(*param, text, fmt::format("run: '{}': tolerance", file));
  return text;
}

}  // namespace

std::string graphJson(const Graph& graph) {
  Json json = {{"format", kFormat}, {"version", kVersion}, {"nodes", Json::array()}};
  if (const auto it = graph.globals.find(kTolerance); it != graph.globals.end())
    json[kTolerance] = it->second;
  for (const Node& node : graph.nodes) json["nodes"].push_back(toJson(node));
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Graph graphFromJson(const std::string& text, const std::string& name,
                    const std::map<std::string, std::string>& globals) {
  const Json json = levelset::isJsonTooDeep(text) ? Json() : Json::parse(text, nullptr, false);
  if (json.is_discarded() || !json.is_object() || json.value("format", Json()) != kFormat)
    throw InvalidInput(fmt::format(
        "run: '{}' is not a graph; write one with --save-graph, or a text with one action a line",
        name));
  if (json.value("version", Json()) != kVersion)
    throw InvalidInput(fmt::format(
        "run: '{}' has version {}, but this program reads version {}; write the file again with "
        "--save-graph",
        name, json.value("version", Json()).dump(-1, ' ', false, Json::error_handler_t::replace),
        kVersion));
  const auto nodes = json.find("nodes");
  if (nodes == json.end() || !nodes->is_array() || nodes->empty())
    throw InvalidInput(
        fmt::format("run: '{}' contains no nodes; add them as a list under \"nodes\"", name));
  std::map<std::string, std::string> all = globals;
  if (json.contains(kTolerance) && !all.contains(kTolerance))
    all[kTolerance] = toleranceText(json[kTolerance], name);
  return GraphReader(*nodes, name, std::move(all)).read();
}

bool isGraphFile(const std::filesystem::path& file) {
  return file.extension() == ".json" || file.extension() == ".JSON";
}

Graph readGraph(const std::filesystem::path& file,
                const std::map<std::string, std::string>& globals) {
  const std::string text = readText(file, "run", kMostBytes);
  return graphFromJson(text, file.string(), globals);
}

void writeGraph(const std::filesystem::path& file, const Graph& graph) {
  writeText(file, graphJson(graph), "--save-graph");
}

}  // namespace pipeline
