#include "apps/pipeline/tolerance/tolerance_graph.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/tolerance/error_model.h"
#include "apps/pipeline/values/refusal.h"
#include "apps/pipeline/values/units.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

using levelset::UsageError;

bool hasTargets(const Node& node) {
  return node.op->targets && !node.op->targets(Invocation(*node.op, node.options)).empty();
}

bool readsStandardInput(const Node& node) {
  return node.op->usesStandardInput &&
         node.op->usesStandardInput(Invocation(*node.op, node.options));
}

bool hasErrorEstimate(Kind kind) {
  return kind == Kind::Band || kind == Kind::Mesh;
}

template <typename Visit>
void forEachOperand(const Node& node, const Visit& visit) {
  for (const std::size_t input : node.inputs) visit(input);
  for (const auto& [option, input] : node.named) visit(input);
}

bool isLength(const Node& node, const std::string& option) {
  const Param* param = node.op->find(option);
  return param && (param->type == ParamType::Length || param->type == ParamType::Lengths);
}

std::string scaledVoxel(const std::string& text, double factor) {
  const Length length = parseLength(text, "--voxel");
  return fmt::format("{}{}", length.number * factor, length.unit == Unit::Percent ? "%" : "");
}

/// Assigns the needed nodes of a graph to the lists of ToleranceParts.
class PartFinder {
 public:
  explicit PartFinder(const Graph& graph)
      : graph_(graph),
        needed_(neededNodes(graph)),
        isEnd_(graph.nodes.size(), 0),
        hasVoxels_(graph.nodes.size(), 0) {}

  ToleranceParts find() {
    for (std::size_t i = 0; i < graph_.nodes.size(); ++i)
      if (needed_[i]) classify(i);
    if (parts_.chosen.empty())
      throw UsageError(
          "--tolerance: every action has a voxel size already; leave out --voxel and --resolution "
          "of an "
          "action that computes a level set, or leave out --tolerance");
    findOutputs();
    parts_.constant = parts_.once;
    return std::move(parts_);
  }

 private:
  void classify(std::size_t i) {
    const Node& node = graph_.nodes[i];
    const bool isMaker = node.makes() && node.kind != Kind::Scene;
    bool dependsOnEnd = false;
    forEachOperand(node, [&](std::size_t input) { dependsOnEnd = dependsOnEnd || isEnd_[input]; });
    if (isMaker && (dependsOnEnd || hasTargets(node)))
      throw UsageError(withLocation(
          fmt::format(
              "{}: writes files while it computes its result, and --tolerance computes the result "
              "more than once; give voxel sizes, or do not write files here",
              node.op->name),
          node.location));
    if (const std::string option = optionWithoutModel(node); !option.empty())
      throw UsageError(withLocation(
          fmt::format("{}: {} has no bound of its error, and --tolerance needs one; leave out {}, "
                      "or give voxel sizes in place of --tolerance",
                      node.op->name, option, option),
          node.location));
    if (!isMaker) {
      isEnd_[i] = 1;
      parts_.ends.push_back(i);
      return;
    }
    if (node.voxelFollows) {
      parts_.chosen.push_back(i);
      hasVoxels_[i] = 1;
      rejectVoxelLengths(node);
    } else if (node.options.contains("voxel") || node.options.contains("resolution")) {
      parts_.fixed.push_back(i);
      hasVoxels_[i] = 1;
    }
    forEachOperand(node, [&](std::size_t input) { hasVoxels_[i] |= hasVoxels_[input]; });
    if (hasVoxels_[i] && readsStandardInput(node))
      throw UsageError(withLocation(
          fmt::format(
              "{}: standard input can be read only once, and --tolerance runs this action more "
              "than once; give a file",
              node.op->name),
          node.location));
    (hasVoxels_[i] ? parts_.again : parts_.once).push_back(i);
  }

  void rejectVoxelLengths(const Node& node) const {
    for (const auto& [option, text] : node.options)
      if (isLength(node, option) && text.find("vx") != std::string::npos)
        throw UsageError(withLocation(
            fmt::format("{}: --{}: '{}' is a length in voxels, and --tolerance chooses their "
                        "size; write it in world units",
                        node.op->name, option, text),
            node.location));
  }

  void findOutputs() {
    std::vector<char> isTaken(graph_.nodes.size(), 0), isFinal(graph_.nodes.size(), 0);
    for (std::size_t i = 0; i < graph_.nodes.size(); ++i)
      if (needed_[i])
        forEachOperand(graph_.nodes[i],
                       [&](std::size_t input) { (isEnd_[i] ? isFinal : isTaken)[input] = 1; });
    for (const std::size_t i : parts_.again) {
      const bool isLast = isFinal[i] || !isTaken[i];
      if (isLast && hasErrorEstimate(graph_.nodes[i].kind) && followsChosen(i))
        parts_.outputs.push_back(i);
    }
    for (std::size_t i = 0; i < graph_.nodes.size(); ++i)
      if (needed_[i] && !isEnd_[i] && (isFinal[i] || !isTaken[i])) parts_.lasting.push_back(i);
    if (parts_.outputs.empty())
      throw UsageError(
          "--tolerance: no result is a level set or a mesh, so there is no error to estimate; end "
          "the "
          "chain with one, or give voxel sizes");
  }

  [[nodiscard]] bool followsChosen(std::size_t i) const {
    if (graph_.nodes[i].voxelFollows) return true;
    bool follows = false;
    forEachOperand(graph_.nodes[i],
                   [&](std::size_t input) { follows = follows || followsChosen(input); });
    return follows;
  }

  const Graph& graph_;
  std::vector<char> needed_, isEnd_, hasVoxels_;
  ToleranceParts parts_;
};

}  // namespace

ToleranceParts toleranceParts(const Graph& graph) {
  return PartFinder(graph).find();
}

std::vector<std::string> voxelLengths(const Graph& graph, const ToleranceParts& parts) {
  std::vector<std::string> sentences;
  for (const std::size_t i : parts.again) {
    const Node& node = graph.nodes[i];
    for (const auto& [option, text] : node.options)
      if (isLength(node, option) && text.find("vx") != std::string::npos)
        sentences.push_back(withLocation(
            fmt::format(
                "{}: --{}: '{}' is a length in voxels, whose size --tolerance chooses; write it "
                "in world units if the surface depends on it",
                node.op->name, option, text),
            node.location));
  }
  return sentences;
}

PartGraph partGraph(const Graph& graph, const std::vector<std::size_t>& keep,
                    const std::map<std::size_t, Value>& given) {
  PartGraph part;
  std::map<std::size_t, std::size_t> number;
  for (const std::size_t i : keep) {
    Node node = graph.nodes[i];
    if (const auto value = given.find(i); value != given.end()) {
      node.op = &givenOperator();
      node.options.clear();
      node.inputs.clear();
      node.named.clear();
      part.graph.given.emplace(part.graph.nodes.size(), value->second);
    }
    for (std::size_t& input : node.inputs) input = number.at(input);
    for (auto& [option, input] : node.named) input = number.at(input);
    number[i] = part.graph.nodes.size();
    part.graph.nodes.push_back(std::move(node));
    part.origin.push_back(i);
  }
  return part;
}

void setVoxels(Graph& graph, const ToleranceParts& parts, double voxel, double coarsening) {
  for (const std::size_t i : parts.chosen)
    graph.nodes[i].options["voxel"] = fmt::format("{}", voxel * coarsening);
  if (coarsening == 1) return;
  for (const std::size_t i : parts.fixed) {
    std::map<std::string, std::string>& options = graph.nodes[i].options;
    if (const auto given = options.find("voxel"); given != options.end()) {
      given->second = scaledVoxel(given->second, coarsening);
    } else {
      const double count =
          static_cast<double>(parseInteger(options.at("resolution"), "--resolution"));
      options["resolution"] = fmt::format("{}", std::max(1L, std::lround(count / coarsening)));
    }
  }
}

void setResolution(Graph& graph, const ToleranceParts& parts, int resolution) {
  for (const std::size_t i : parts.chosen)
    graph.nodes[i].options["resolution"] = fmt::format("{}", resolution);
}

std::string nameOf(const Node& node) {
  return node.name.empty() ? node.op->name : "@" + node.name;
}

}  // namespace pipeline
