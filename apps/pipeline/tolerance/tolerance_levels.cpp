#include "apps/pipeline/tolerance/tolerance_levels.h"

#include <algorithm>
#include <set>

#include "apps/pipeline/graph/graph_file.h"
#include "apps/pipeline/tolerance/error_model.h"
#include "apps/process_cost.h"
#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"

namespace pipeline {
namespace {

/// Selects the nodes of `from` that are operands of a node of `by`.
std::vector<std::size_t> operandsAmong(const Graph& graph, const std::vector<std::size_t>& from,
                                       const std::vector<std::size_t>& by) {
  std::set<std::size_t> taken;
  for (const std::size_t i : by) {
    const Node& node = graph.nodes[i];
    taken.insert(node.inputs.begin(), node.inputs.end());
    for (const auto& [option, input] : node.named) taken.insert(input);
  }
  std::vector<std::size_t> result;
  for (const std::size_t i : from)
    if (taken.contains(i)) result.push_back(i);
  return result;
}

std::vector<std::size_t> joined(std::vector<std::size_t> a, const std::vector<std::size_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  std::sort(a.begin(), a.end());
  a.erase(std::unique(a.begin(), a.end()), a.end());
  return a;
}

void requestResults(PartGraph& part, const std::vector<std::size_t>& wanted) {
  for (std::size_t i = 0; i < part.origin.size(); ++i)
    if (std::binary_search(wanted.begin(), wanted.end(), part.origin[i]))
      part.graph.results.push_back(i);
}

}  // namespace

LevelRunner::LevelRunner(const Graph& graph, const ToleranceParts& parts,
                         const RunSettings& settings)
    : graph_(graph), parts_(parts), settings_(settings) {
  std::vector<std::size_t> before;
  for (const std::size_t i : parts.outputs) {
    const Node& node = graph.nodes[i];
    if (node.kind == Kind::Mesh && node.inputs.size() == 1 &&
        graph.nodes[node.inputs[0]].kind == Kind::Band)
      before.push_back(node.inputs[0]);
  }
  for (const std::size_t i : parts.again) {
    const Node& node = graph.nodes[i];
    if (node.op->name == "level-set")
      meshes_.push_back(node.inputs.at(0));
    else if (node.kind == Kind::Band && errorModel(*node.op).creaseConstant > 0)
      hasCreases_ = true;
  }
  meshes_ = joined(meshes_, {});
  watched_ = joined(joined(parts.outputs, before), joined(meshes_, parts.lasting));
}

RunSettings LevelRunner::settingsFor(const PartGraph& part) const {
  RunSettings settings = settings_;
  settings.measurePeaks = true;  // they predict the memory of finer voxels
  if (settings_.progress)
    settings.progress = [this, &part](std::size_t index, const std::string& action,
                                      double fraction) {
      settings_.progress(part.origin[index], action, fraction);
    };
  return settings;
}

void LevelRunner::computeOnce(RunReport& report) {
  if (parts_.once.empty()) return;
  const std::vector<std::size_t> wanted =
      operandsAmong(graph_, parts_.once, joined(parts_.again, parts_.ends));
  PartGraph part = partGraph(graph_, parts_.once, {});
  requestResults(part, joined(wanted, parts_.lasting));
  RunSettings settings = settingsFor(part);
  settings.onValue = [&](std::size_t node, const Value& value) {
    const std::size_t origin = part.origin[node];
    if (std::binary_search(wanted.begin(), wanted.end(), origin) ||
        std::binary_search(watched_.begin(), watched_.end(), origin))
      once_.insert_or_assign(origin, value);
  };
  pipeline::run(part.graph, settings, report);
}

PartGraph LevelRunner::repeatedAndEnds() const {
  const std::vector<std::size_t> rest = joined(parts_.again, parts_.ends);
  return partGraph(graph_, joined(rest, operandsAmong(graph_, parts_.once, rest)), once_);
}

std::map<std::size_t, Value> LevelRunner::planAll(int resolution, RunReport& report) const {
  PartGraph part = repeatedAndEnds();
  ToleranceParts inPart;
  for (std::size_t i = 0; i < part.origin.size(); ++i)
    if (std::binary_search(parts_.chosen.begin(), parts_.chosen.end(), part.origin[i]))
      inPart.chosen.push_back(i);
  setResolution(part.graph, inPart, resolution);
  RunSettings settings = settingsFor(part);
  settings.dryRun = true;
  settings.cache.clear();
  settings.begin = {};
  settings.progress = {};
  settings.warn = settings.note = settings.print = [](const std::string&) {};
  std::map<std::size_t, Value> plans;
  settings.onValue = [&](std::size_t node, const Value& value) {
    plans.insert_or_assign(part.origin[node], value);
  };
  pipeline::run(part.graph, settings, report);
  return plans;
}

void LevelRunner::planAt(double voxel, RunReport& report) const {
  PartGraph part = repeatedAndEnds();
  ToleranceParts inPart;
  for (std::size_t i = 0; i < part.origin.size(); ++i)
    if (std::binary_search(parts_.chosen.begin(), parts_.chosen.end(), part.origin[i]))
      inPart.chosen.push_back(i);
  setVoxels(part.graph, inPart, voxel, 1);
  pipeline::run(part.graph, settingsFor(part), report);
}

Level LevelRunner::runAt(double voxel, double coarsening) {
  Graph sized = graph_;
  setVoxels(sized, parts_, voxel, coarsening);
  PartGraph part = partGraph(
      sized, joined(parts_.again, operandsAmong(graph_, parts_.once, parts_.again)), once_);
  requestResults(part, watched_);
  Level level;
  level.voxelSize = voxel * coarsening;
  std::map<std::size_t, Value> made;
  RunSettings settings = settingsFor(part);
  settings.measureErrors = settings_.measureErrors && coarsening == 1;
  if (coarsening != 1) settings.thumbnails = 0;
  settings.onValue = [&](std::size_t node, const Value& value) {
    if (std::binary_search(watched_.begin(), watched_.end(), part.origin[node]))
      made.insert_or_assign(part.origin[node], value);
  };
  const auto collect = [&](Message::Kind kind) {
    return [&level, kind](const std::string& text) { level.messages.push_back({kind, text}); };
  };
  settings.print = collect(Message::Kind::Print);
  settings.warn = collect(Message::Kind::Warn);
  settings.note = collect(Message::Kind::Note);
  try {
    pipeline::run(part.graph, settings, level.report);
  } catch (const levelset::NumericalError& error) {
    // A numeric check that fails in a step ends the run only after all steps, so the values may
    // exist.
    for (const std::size_t i : parts_.outputs)
      if (!made.contains(i)) throw;
    level.failure = error.what();
  }
  for (const StepReport& step : level.report.steps) {
    level.peakBytes = std::max(level.peakBytes, step.peakBytes);
    level.voxels += step.activeVoxels;
  }
  for (std::size_t output = 0; output < parts_.outputs.size(); ++output) {
    level.surfaces.push_back(surfaceOf(output, made, voxel * coarsening));
    level.triangles += level.surfaces.back().surface.mesh().triangles.size();
  }
  for (const std::size_t i : meshes_) {
    if (!std::binary_search(parts_.constant.begin(), parts_.constant.end(), i)) continue;
    const auto again = made.find(i), once = once_.find(i);
    const Value* mesh = again != made.end()   ? &again->second
                        : once != once_.end() ? &once->second
                                              : nullptr;
    if (mesh && !exact_.contains(i)) exact_.emplace(i, levelset::TriangleSurface(mesh->mesh()));
  }
  for (const std::size_t i : parts_.lasting)
    if (const auto it = made.find(i); it != made.end()) level.values.insert(*it);
  level.peakBytes = std::max(level.peakBytes, apps::peakResidentBytes());
  return level;
}

LevelSurface LevelRunner::surfaceOf(std::size_t output, const std::map<std::size_t, Value>& made,
                                    double voxel) const {
  const std::size_t node = parts_.outputs[output];
  const Value& value = made.at(node);
  LevelSurface level{.voxelSize = voxel};
  const auto meshOf = [&](const Value& solid) {
    level.voxelSize = solid.band().voxelSize();
    return levelset::withContext("the surface of a result", [&] {
      return levelset::TriangleSurface(levelset::bandToMesh(solid.band()));
    });
  };
  if (value.kind() == Kind::Band) {
    level.surface = level.uniform = meshOf(value);
  } else {
    level.surface = levelset::TriangleSurface(value.mesh());
    const Node& maker = graph_.nodes[node];
    if (maker.inputs.size() == 1)
      if (const auto before = made.find(maker.inputs[0]);
          before != made.end() && before->second.kind() == Kind::Band)
        level.uniform = meshOf(before->second);
  }
  level.diagonal = levelset::bounds(level.surface.mesh()).size().length();
  for (const std::size_t i : meshes_) {
    const auto again = made.find(i), once = once_.find(i);
    const Value* mesh = again != made.end()   ? &again->second
                        : once != once_.end() ? &once->second
                                              : nullptr;
    if (mesh && mesh->kind() == Kind::Mesh)
      level.heldEdge = std::max(level.heldEdge, levelset::flatBesideEdges(mesh->mesh()));
  }
  return level;
}

std::optional<double> LevelRunner::knownError(const Level& level, std::size_t output) {
  const Node* node = &graph_.nodes[parts_.outputs[output]];
  if (node->op->name == "mesh") node = &graph_.nodes[node->inputs.at(0)];
  if (node->op->name != "level-set") return {};
  const auto exact = exact_.find(node->inputs.at(0));
  if (exact == exact_.end()) return {};
  const LevelSurface& surface = level.surfaces[output];
  levelset::SurfaceDifferenceOptions options{.spacing = surface.voxelSize};
  if (settings_.shouldContinue)
    options.progress = [this](double) { return settings_.shouldContinue(); };
  return levelset::surfaceDifference(surface.surface, exact->second, options).smooth;
}

LevelDifference LevelRunner::difference(const Level& fine, const Level& coarse,
                                        std::size_t output) const {
  // In voxels of the coarse run. Crease detection reads normals up to this distance on both sides
  // of an edge, so the faces must be flat over it.
  constexpr double kFlatVoxels = 4;
  // In voxels of the coarse run. Within this distance of an edge, triangles cut off the edge or are
  // affected by its rounding.
  constexpr double kCreaseReach = 2.5;
  const LevelSurface &near = fine.surfaces[output], &far = coarse.surfaces[output];
  levelset::SurfaceDifferenceOptions options{.spacing = near.voxelSize,
                                             .creaseRadius = kCreaseReach * far.voxelSize};
  if (settings_.shouldContinue)
    options.progress = [this](double) { return settings_.shouldContinue(); };
  const bool mayHaveCreases = hasCreases_ || near.heldEdge >= kFlatVoxels * far.voxelSize;
  if (mayHaveCreases && near.uniform.isValid() && far.uniform.isValid())
    options.creases = levelset::findCreases(near.uniform.mesh(), near.voxelSize, far.uniform.mesh(),
                                            far.voxelSize);
  const levelset::SurfaceDifference found =
      levelset::surfaceDifference(near.surface, far.surface, options);
  return {.smooth = found.smooth, .crease = found.crease, .creaseShare = found.creaseShare};
}

void LevelRunner::runEnds(const Level& level, RunReport& report) const {
  std::map<std::size_t, Value> given = once_;
  for (const auto& [node, value] : level.values) given.insert_or_assign(node, value);
  PartGraph part = partGraph(graph_, joined(parts_.ends, parts_.lasting), given);
  pipeline::run(part.graph, settingsFor(part), report);
}

}  // namespace pipeline
