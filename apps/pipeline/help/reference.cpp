#include "apps/pipeline/help/reference.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/pipeline/help/help.h"

namespace pipeline {
namespace {

/// Escapes the characters that Markdown would interpret, and `|`, which ends a cell of a table.
std::string inMarkdown(const std::string& text) {
  std::string result;
  bool isCode = false;
  for (char c : text) {
    if (c == '`') isCode = !isCode;
    if (c == '|' || (!isCode && (c == '*' || c == '_' || c == '<'))) result += '\\';
    result += c;
  }
  return result;
}

std::string asCode(const std::string& text) {
  return text.empty() ? "" : "`" + text + "`";
}

std::string sentence(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z')
    text[0] = static_cast<char>(text[0] - 'a' + 'A');
  if (!text.empty() && text.back() != '.') text += '.';
  return text;
}

std::string unitOf(const Param& param) {
  switch (param.type) {
    case ParamType::Length:
    case ParamType::Lengths:
      return param.allowsVoxels ? "world, vx, %" : "world, %";
    case ParamType::Point:
    case ParamType::Points:
    case ParamType::Box:
      return "world";
    case ParamType::Degrees:
      return "degrees";
    case ParamType::ImageSize:
      return "pixels";
    case ParamType::Bytes:
      return "bytes, K M G T";
    default:
      return "";
  }
}

std::string rangeOf(const Param& param) {
  std::vector<std::string> all;
  for (const std::string& choice : param.choices) all.push_back(asCode(choice));
  if (param.type == ParamType::Velocity) all.push_back("three formulas, `@NAME`");
  if (takesDistance(param.type)) all.push_back("a number, a formula, `@NAME`");
  if (param.type == ParamType::Mesh || param.type == ParamType::Solid) all.push_back("`@NAME`");
  if (param.allowsAuto) all.push_back("`auto`");
  if (param.range == Range::Positive) all.push_back("> 0");
  if (param.range == Range::NonNegative) all.push_back("≥ 0");
  return fmt::format("{}", fmt::join(all, ", "));
}

std::string paramTable(const std::vector<Param>& params) {
  if (params.empty()) return "";
  std::string text =
      "| parameter | type | unit | default | range | meaning |\n|---|---|---|---|---|---|\n";
  for (const Param& param : params) {
    text += fmt::format("| {} | {} | {} | {} | {} | {} |\n",
                        asCode(param.position >= 0 ? param.name : "--" + param.name),
                        typeName(param.type), unitOf(param),
                        param.required ? "needed" : inMarkdown(asCode(param.fallback)),
                        inMarkdown(rangeOf(param)), inMarkdown(param.doc));
  }
  return text + "\n";
}

/// Returns the anchor that GitHub gives to a heading.
std::string anchorOf(std::string heading) {
  std::replace(heading.begin(), heading.end(), ' ', '-');
  std::transform(heading.begin(), heading.end(), heading.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return heading;
}

std::string actionText(const Operator& op) {
  std::string text = fmt::format("### {}\n{}\n\n", op.name, inMarkdown(sentence(op.summary)));
  if (!op.details.empty()) text += inMarkdown(op.details) + "\n\n";
  if (!op.operands.empty()) {
    text += fmt::format("Operands: {}{}.{}\n\n", operandText(op),
                        op.flow == Flow::PassesThrough ? " (stays on the stack)" : "",
                        op.operandsOptional ? " The operands may be left out." : "");
  }
  text += paramTable(op.params);
  if (!op.example.empty()) text += "```sh\n" + op.example + "\n```\n\n";
  return text;
}

}  // namespace

std::string referencePage() {
  std::string text =
      "# Reference\n\nEvery action with its parameters. `levelsmith help --markdown` writes this "
      "page from the declarations in the program.\n[command-line.md](command-line.md) describes "
      "what all actions share, such as types and units. [operators.md](operators.md)\ndescribes "
      "how actions work. Parameters shown without dashes may be given without their name. Actions "
      "that compute a\nvalue also take `--as NAME`.\n\n";
  for (const HelpGroup& group : helpGroups()) {
    std::vector<std::string> links;
    for (const Operator* op : group.actions) links.push_back(fmt::format("[{0}](#{0})", op->name));
    text +=
        fmt::format("- [{}](#{}): {}\n", group.name, anchorOf(group.name), fmt::join(links, " "));
  }
  text += "- [Global options](#global-options)\n\n";
  for (const HelpGroup& group : helpGroups()) {
    text += "## " + group.name + "\n\n";
    for (const Operator* op : group.actions) text += actionText(*op);
  }
  text += "## Global options\n\nGlobal options are given before the first action.\n\n";
  text += paramTable(globalParams());
  text.pop_back();
  return text;
}

}  // namespace pipeline
