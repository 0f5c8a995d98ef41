#include "apps/pipeline/graph/graph.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/refusal.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

std::string mismatch(const Operator& op, std::size_t index, Kind found,
                     const std::vector<Kind>& allowed) {
  const char* remedy = "";
  const auto takes = [&](Kind kind) {
    return std::find(allowed.begin(), allowed.end(), kind) != allowed.end();
  };
  if (found == Kind::Mesh && takes(Kind::Band)) remedy = "; put 'level-set' before it";
  if (found == Kind::Band && !allowed.empty() && allowed[0] == Kind::Mesh)
    remedy = "; put 'mesh' before it";
  if (found == Kind::Surface)
    remedy = "; it has no inside, so only patches and 'texture --alone' can use it";
  if (found == Kind::Adaptive)
    remedy = takes(Kind::Band) ? "; put 'to-band' before it" : "; put 'mesh' before it";
  if (found == Kind::Segmentation)
    remedy = takes(Kind::Band) ? "; put 'extract LABEL' before it" : "; put 'mesh' before it";
  if (found == Kind::Patch) remedy = "; 'texture' builds a level set from it";
  if (found == Kind::Deformation)
    remedy = "; 'deform' moves other values by it, and takes it as the last operand";
  if (found == Kind::Scene) remedy = "; 'render' draws it, 'write' saves it as .json";
  std::string kinds;
  for (std::size_t i = 0; i < allowed.size(); ++i)
    kinds += fmt::format("{}{}",
                         i == 0                    ? ""
                         : i + 1 == allowed.size() ? " or "
                                                   : ", ",
                         kindPhrase(allowed[i]));
  return fmt::format("{}: operand {} is {}, but {} is needed{}", op.name, index + 1,
                     kindPhrase(found), kinds, remedy);
}

/// Options that may replace the missing operands, as the end of a message.
std::string optionsInPlace(const Operator& op, std::size_t found) {
  const std::vector<std::string>& options = found == 0 ? op.noneWith : op.aloneWith;
  std::string text;
  for (std::size_t i = 0; i < options.size() && found < 2; ++i)
    text += fmt::format("{}--{}",
                        i == 0                    ? "; or give "
                        : i + 1 == options.size() ? " or "
                                                  : ", ",
                        options[i]);
  return text;
}

void checkOperands(const Node& node, const std::vector<Node>& before) {
  const Operator& op = *node.op;
  const std::size_t wanted = op.operandCount(node.options), found = node.inputs.size();
  if (found > wanted && (!op.takesMore || op.isAlone(node.options))) {
    throw UsageError(fmt::format("{}: takes {} operand{}, not {}", op.name, wanted,
                                 wanted == 1 ? "" : "s", found));
  }
  if (found < wanted && !op.operandsOptional) {
    throw UsageError(fmt::format(
        "{}: needs {} operand{} but has {}; read or compute {} first, or name {} "
        "with '@'{}",
        op.name, wanted, wanted == 1 ? "" : "s", found, wanted - found == 1 ? "one" : "them",
        wanted - found == 1 ? "it" : "them", optionsInPlace(op, found)));
  }
  for (std::size_t i = 0; i < found; ++i) {
    const std::vector<Kind>& allowed = op.operands[std::min(i, op.operands.size() - 1)];
    const Kind kind = before[node.inputs[i]].kind;
    if (std::find(allowed.begin(), allowed.end(), kind) == allowed.end())
      throw UsageError(mismatch(op, i, kind, allowed));
  }
}

void checkNamed(const Node& node, const std::vector<Node>& before) {
  for (const auto& [option, number] : node.named) {
    const Node& value = before[number];
    const ParamType type = node.op->find(option)->type;
    const bool isMesh = type == ParamType::Mesh, isSolid = type == ParamType::Solid,
               isScalar = takesDistance(type);
    if (isMesh    ? value.kind == Kind::Mesh
        : isSolid ? value.kind == Kind::Band
                  : value.kind == Kind::Field || (isScalar && value.kind == Kind::Band))
      continue;
    throw UsageError(fmt::format("{}: --{}: '@{}' is {}, but a {} is needed", node.op->name, option,
                                 value.name, kindPhrase(value.kind),
                                 isMesh     ? "mesh"
                                 : isSolid  ? "level set"
                                 : isScalar ? "field or a level set"
                                            : "field"));
  }
}

std::vector<std::string> targetsOf(const Node& node) {
  if (!node.op->targets) return {};
  return node.op->targets(Invocation(*node.op, node.options));
}

struct FileRead {
  std::string name;
  /// The name stands for further files: a scene, or a sequence with '#'.
  bool standsForOthers = false;
};

std::vector<FileRead> filesRead(const Node& node) {
  const std::vector<std::string> targets = targetsOf(node);
  const auto format = node.options.find("format");
  const bool isJson = format != node.options.end() && format->second == "json";
  std::vector<FileRead> files;
  for (const Param& param : node.op->params) {
    if (param.type != ParamType::Path) continue;
    const auto given = node.options.find(param.name);
    if (given == node.options.end()) continue;
    const std::string& name = given->second;
    if (std::find(targets.begin(), targets.end(), name) == targets.end())
      files.push_back({name, isJson || std::filesystem::path(name).extension() == ".json" ||
                                 name.find('#') != std::string::npos});
  }
  return files;
}

/// Files that nodes write, each with the node that was last added as its writer.
class Written {
 public:
  void add(const Graph& graph, std::size_t writer) {
    const Node& node = graph.nodes[writer];
    // Writing a scene also writes a file for each of its solids into the folder of the scene file.
    // So the complete folder counts as written.
    const bool isScene =
        std::any_of(node.inputs.begin(), node.inputs.end(),
                    [&](std::size_t input) { return graph.nodes[input].kind == Kind::Scene; });
    for (const std::string& target : targetsOf(node)) {
      if (target == "-") continue;
      const std::filesystem::path path = absolutePath(target);
      writers_[isScene ? path.parent_path() : path] = writer;
      last_ = writer;
    }
  }

  /// Finds the last writer of a file or of a folder that contains it. For a name that stands for
  /// further files, finds the last writer of any file.
  [[nodiscard]] std::optional<std::size_t> find(const FileRead& file) const {
    if (!last_ || file.standsForOthers) return last_;
    std::optional<std::size_t> found;
    for (std::filesystem::path path = absolutePath(file.name);; path = path.parent_path()) {
      if (const auto it = writers_.find(path); it != writers_.end())
        found = std::max(found, std::optional(it->second));
      if (!path.has_relative_path()) return found;
    }
  }

 private:
  static std::filesystem::path absolutePath(const std::string& file) {
    std::error_code ignored;
    return std::filesystem::weakly_canonical(std::filesystem::absolute(file, ignored), ignored);
  }

  std::map<std::filesystem::path, std::size_t> writers_;
  std::optional<std::size_t> last_;
};

}  // namespace

const Operator& givenOperator() {
  static const Operator op{.name = "given",
                           .group = "",
                           .summary = "a value from outside the graph",
                           .isRepeatable = false};
  return op;
}

void Graph::addRenamed(const std::string& written, const std::string& name) {
  if (written == name) return;
  const std::string sentence = renamedSentence(written, name);
  if (std::find(renamed.begin(), renamed.end(), sentence) == renamed.end())
    renamed.push_back(sentence);
}

namespace {

/// An action with the kinds of its operands, before anything runs.
Invocation probeOf(const Node& node, const std::vector<Node>& before) {
  Invocation probe(*node.op, node.options);
  probe.voxelFollows = node.voxelFollows;
  for (const std::size_t input : node.inputs)
    probe.operands.emplace_back(Plan{.kind = before[input].kind});
  return probe;
}

}  // namespace

void leaveVoxelOpen(Node& node, const std::vector<Node>& before) {
  const bool canBeTold =
      node.op->find("voxel") && node.op->find("resolution") &&
      (!node.op->takesVoxelSize || node.op->takesVoxelSize(probeOf(node, before)));
  node.voxelFollows =
      canBeTold && !node.options.contains("voxel") && !node.options.contains("resolution");
}

Kind checkNode(const Node& node, const std::vector<Node>& before) {
  const Operator& op = *node.op;
  checkOperands(node, before);
  checkNamed(node, before);
  const Invocation probe = probeOf(node, before);
  if (op.validate) {
    try {
      op.validate(probe);
    } catch (const levelset::Error& error) {
      rethrowAs(op.name, error);
    }
  }
  return node.makes() && op.resultKind ? op.resultKind(probe) : Kind::Band;
}

std::vector<char> neededNodes(const Graph& graph) {
  const std::vector<Node>& nodes = graph.nodes;
  // A node that computes a value and also writes files is needed because of its files.
  const auto actsOutside = [](const Node& node) {
    return !node.makes() || !targetsOf(node).empty();
  };
  std::vector<char> needed(nodes.size(), 0);
  for (std::size_t i = 0; i < nodes.size(); ++i) needed[i] = actsOutside(nodes[i]) ? 1 : 0;
  for (const std::size_t result : graph.results) needed[result] = 1;
  if (std::find(needed.begin(), needed.end(), 1) == needed.end())
    return std::vector<char>(nodes.size(), 1);
  for (std::size_t i = nodes.size(); i-- > 0;) {
    if (!needed[i]) continue;
    for (const std::size_t input : nodes[i].inputs) needed[input] = 1;
    for (const auto& [option, input] : nodes[i].named) needed[input] = 1;
  }
  return needed;
}

std::vector<std::optional<std::size_t>> findWritersRead(const Graph& graph,
                                                        const std::vector<char>& needed) {
  std::vector<std::optional<std::size_t>> writers(graph.nodes.size());
  Written written;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (!needed[i]) continue;
    for (const FileRead& file : filesRead(graph.nodes[i]))
      writers[i] = std::max(writers[i], written.find(file));
    written.add(graph, i);
  }
  return writers;
}

std::vector<char> findOverwritten(const Graph& graph, const std::vector<char>& needed) {
  std::vector<char> is(graph.nodes.size(), 0);
  Written behind;
  for (std::size_t i = graph.nodes.size(); i-- > 0;) {
    if (!needed[i]) continue;
    for (const FileRead& file : filesRead(graph.nodes[i]))
      if (behind.find(file)) is[i] = 1;
    behind.add(graph, i);
  }
  return is;
}

bool readsOnce(const Node& node) {
  const Invocation probe(*node.op, node.options);
  if (node.op->usesStandardInput && node.op->usesStandardInput(probe)) return true;
  return std::any_of(node.op->params.begin(), node.op->params.end(), [&](const Param& param) {
    std::error_code ignored;
    const auto given = node.options.find(param.name);
    return param.type == ParamType::Path && given != node.options.end() &&
           std::filesystem::is_other(std::filesystem::status(given->second, ignored));
  });
}

std::vector<std::size_t> countUses(const Graph& graph, const std::vector<char>& needed) {
  std::vector<std::size_t> uses(graph.nodes.size(), 0);
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    if (!needed[i]) continue;
    for (const std::size_t input : graph.nodes[i].inputs) ++uses[input];
    for (const auto& [option, input] : graph.nodes[i].named) ++uses[input];
  }
  return uses;
}

}  // namespace pipeline
