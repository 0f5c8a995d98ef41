#include "apps/pipeline/help/help.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "apps/pipeline/help/completion.h"
#include "apps/pipeline/help/graph_schema.h"
#include "apps/pipeline/help/reference.h"
#include "apps/pipeline/values/units.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

std::string optionForm(const Param& param) {
  const std::string value = valueForm(param);
  const std::string name = param.position >= 0 ? param.name : "--" + param.name;
  return value.empty() || param.position >= 0 ? name : name + " " + value;
}

std::string optionLine(const Param& param) {
  std::string line = fmt::format("  {:<30} {}", optionForm(param), param.doc);
  if (!param.fallback.empty()) line += fmt::format(" [{}]", param.fallback);
  if (param.required) line += " (needed)";
  return line + "\n";
}

std::vector<const Operator*> helpTopics() {
  std::vector<const Operator*> topics;
  for (const HelpGroup& group : helpGroups())
    topics.insert(topics.end(), group.actions.begin(), group.actions.end());
  return topics;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

std::vector<HelpGroup> helpGroups() {
  std::vector<HelpGroup> groups;
  const auto add = [&](const Operator& op) {
    const auto known = std::find_if(groups.begin(), groups.end(),
                                    [&](const HelpGroup& group) { return group.name == op.group; });
    if (known == groups.end())
      groups.push_back({op.group, {&op}});
    else
      known->actions.push_back(&op);
  };
  for (const Operator& op : operators()) add(op);
  add(runOperator());
  return groups;
}

std::string operandText(const Operator& op) {
  if (op.operands.empty()) return "none";
  std::string text;
  for (const std::vector<Kind>& kinds : op.operands) {
    if (!text.empty()) text += ", ";
    if (kinds.size() == kKinds) {
      text += "any value";
      continue;
    }
    for (std::size_t i = 0; i < kinds.size(); ++i)
      text += (i ? " or " : "") + std::string(kindName(kinds[i]));
  }
  if (op.takesMore) text += ", …";
  for (std::size_t i = 0; i < op.aloneWith.size(); ++i)
    text += (i == 0 ? "; the first alone with --" : " or --") + op.aloneWith[i];
  for (std::size_t i = 0; i < op.noneWith.size(); ++i)
    text += (i == 0 ? "; none with --" : " or --") + op.noneWith[i];
  return text;
}

std::string helpOverview() {
  std::string text =
      "levelsmith: level-set modelling on sparse grids\n\n"
      "  levelsmith [global options] ACTION [args] ! ACTION [args] ! …\n\n"
      "Values are on a stack: an action takes its operands from the top and pushes its result. "
      "--as NAME names a\n"
      "result, @NAME uses it as an operand. Lengths are world units (0.5), voxels (2vx) or a share "
      "of the diagonal (1%).\n";
  for (const HelpGroup& group : helpGroups()) {
    text += "\n" + group.name + "\n";
    for (const Operator* op : group.actions)
      text += fmt::format("  {:<14} {}\n", op->name, op->summary);
  }
  text +=
      "\nHelp\n  help           this page; `help ACTION`, `help ACTION --json`, `help --search "
      "WORD`\n                 `help --markdown` (docs/reference.md), `help --schema` (of graphs), "
      "`help --completion bash|zsh`\n\nGlobal options\n";
  for (const Param& param : globalParams()) text += optionLine(param);
  text +=
      "  --version                      print the version\n\n"
      "Exit codes: 0 done, 2 usage, 3 input, 4 resource, 5 numeric check failed, 6 file, 130 "
      "interrupted.\n";
  return text;
}

std::string helpPage(const Operator& op) {
  std::string text = fmt::format("levelsmith {}: {}\n", op.name, op.summary);
  if (!op.details.empty()) text += "\n" + op.details + "\n";
  text += fmt::format(
      "\nOperands: {}{}\n", operandText(op),
      op.flow == Flow::PassesThrough && !op.operands.empty() ? " (stays on the stack)" : "");
  if (!op.params.empty()) {
    text += "\n";
    for (const Param& param : op.params) text += optionLine(param);
  }
  if (op.flow == Flow::Makes)
    text += optionLine({.name = "as", .type = ParamType::Text, .doc = "name the result"});
  if (!op.example.empty()) text += "\nExample\n  " + op.example + "\n";
  return text;
}

std::string helpJson(const Operator& op) {
  nlohmann::ordered_json json;
  json["name"] = op.name;
  json["group"] = op.group;
  json["summary"] = op.summary;
  json["details"] = op.details;
  json["example"] = op.example;
  json["operands"] = nlohmann::ordered_json::array();
  for (const std::vector<Kind>& kinds : op.operands) {
    nlohmann::ordered_json names = nlohmann::ordered_json::array();
    for (Kind kind : kinds) names.push_back(kindName(kind));
    json["operands"].push_back(names);
  }
  json["takes_more"] = op.takesMore;
  if (!op.aloneWith.empty()) json["alone_with"] = op.aloneWith;
  if (!op.noneWith.empty()) json["none_with"] = op.noneWith;
  json["passes_through"] = op.flow == Flow::PassesThrough;
  json["parameters"] = nlohmann::ordered_json::array();
  for (const Param& param : op.params) {
    nlohmann::ordered_json entry{{"name", param.name},
                                 {"type", typeName(param.type)},
                                 {"doc", param.doc},
                                 {"required", param.required}};
    if (!param.fallback.empty()) entry["default"] = param.fallback;
    if (!param.choices.empty()) entry["choices"] = param.choices;
    if (param.range != Range::Any)
      entry["range"] = param.range == Range::Positive ? "positive" : "non-negative";
    if (param.position >= 0) entry["position"] = param.position;
    json["parameters"].push_back(entry);
  }
  return json.dump(2) + "\n";
}

std::string helpSearch(const std::string& word) {
  const std::string wanted = lower(word);
  std::string text;
  for (const Operator* op : helpTopics()) {
    const bool inOperator =
        lower(op->name + " " + op->summary + " " + op->details).find(wanted) != std::string::npos;
    std::string lines;
    for (const Param& param : op->params)
      if (lower(param.name + " " + param.doc).find(wanted) != std::string::npos)
        lines += "  " + optionLine(param);
    if (inOperator || !lines.empty())
      text += fmt::format("  {:<14} {}\n{}", op->name, op->summary, lines);
  }
  return text.empty()
             ? fmt::format("Nothing mentions '{}'; `levelsmith help` lists all actions.\n", word)
             : text;
}

namespace {

/// Returns the page for --markdown, --schema or --completion SHELL alone; empty for other words.
std::string wholePage(const std::vector<std::string>& words) {
  if (words[0] == "--markdown" && words.size() == 1) return referencePage();
  if (words[0] == "--schema" && words.size() == 1) return graphSchema();
  if (words[0].starts_with("--completion=") && words.size() == 1)
    return completionScript(words[0].substr(13));
  if (words[0] == "--completion" && words.size() == 2) return completionScript(words[1]);
  if (words[0] == "--completion" && words.size() == 1)
    throw UsageError("help: --completion needs a shell: bash or zsh");
  return "";
}

}  // namespace

std::string help(const std::vector<std::string>& words) {
  if (!words.empty())
    if (std::string page = wholePage(words); !page.empty()) return page;
  std::string name, search;
  bool json = false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--json") {
      json = true;
    } else if (words[i] == "--search") {
      if (++i == words.size()) throw UsageError("help: --search needs a word");
      search = words[i];
    } else if (words[i].starts_with("--search=")) {
      search = words[i].substr(9);
    } else if (name.empty() && !words[i].starts_with("-")) {
      name = words[i];
    } else {
      throw UsageError(fmt::format(
          "help: unexpected word '{}'; use `help ACTION [--json]`, `help --search WORD`, or one of "
          "--markdown, --schema and --completion SHELL alone",
          words[i]));
    }
  }
  if (!search.empty()) return helpSearch(search);
  if (name.empty() || name == "help") return helpOverview();
  const std::vector<const Operator*> topics = helpTopics();
  const Operator* known = findOperator(name);
  const auto op = std::find_if(topics.begin(), topics.end(), [&](const Operator* topic) {
    return topic->name == (known ? known->name : name);
  });
  if (op == topics.end()) {
    std::vector<std::string> names;
    names.reserve(topics.size());
    for (const Operator* each : topics) names.push_back(each->name);
    const std::string guess = didYouMean(name, names);
    throw UsageError(fmt::format("help: there is no action '{}'{}", name,
                                 guess.empty() ? "; `levelsmith help` lists them"
                                               : fmt::format("; did you mean '{}'?", guess)));
  }
  return json ? helpJson(**op) : helpPage(**op);
}

}  // namespace pipeline
