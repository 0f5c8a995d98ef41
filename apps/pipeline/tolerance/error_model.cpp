#include "apps/pipeline/tolerance/error_model.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

// Largest errors of meshes (`mesh_linf_vx` of results.csv) times radius over voxel, the worst of
// all resolutions and placements of the quick budget, rounded up. What resamples or moves a surface
// adds as much again as its triangles do.
constexpr double kTriangles = 0.35, kEdge = 0.55;
constexpr std::array kModels = {
    ErrorModel{"sphere", 2, kTriangles, 0, "shapes"},
    ErrorModel{"torus", 2, kTriangles, 0, "shapes"},
    ErrorModel{"capsule", 2, kTriangles, 0, "shapes"},
    ErrorModel{"cylinder", 2, kTriangles, kEdge, "shapes"},
    ErrorModel{"box", 2, 0, kEdge, "shapes"},
    ErrorModel{"level-set", 1, 0.7, kEdge, "mesh-round-trip"},
    ErrorModel{"union", 2, kTriangles, kEdge, "csg-balls"},
    ErrorModel{"intersection", 2, kTriangles, kEdge, "csg-balls"},
    ErrorModel{"difference", 2, kTriangles, kEdge, "csg-balls"},
    ErrorModel{"clip", 2, kTriangles, kEdge, "csg-balls"},
    ErrorModel{"shell", 2, kTriangles, kEdge, "shell"},
    ErrorModel{"blend", 2, 0.5, 0, "fillet-balls"},
    ErrorModel{"offset", 2, kTriangles, kEdge, "offset-sphere"},
    ErrorModel{"open", 2, 0.6, 0, "opening-closing"},
    ErrorModel{"close", 2, 0.6, kEdge, "opening-closing"},
    ErrorModel{"reinitialize", 2, kTriangles, 0, "redistance"},
    ErrorModel{"widen", 2, kTriangles, 0, "half-widths"},
    ErrorModel{"smooth", 2, kTriangles, 0, "smooth"},
    ErrorModel{"curvature-flow", 2, 0.9, 0, "curvature-sphere"},
    ErrorModel{"advect", 2, 1.1, 0, "rigid-rotation"},
    ErrorModel{"morph", 2, 0.45, kEdge, "morph"},
    ErrorModel{"resample", 2, 0.65, 0, "resample-chain"},
    ErrorModel{"transform", 2, 0.65, 0, "resample-chain"},
    ErrorModel{"mesh", 2, kTriangles, 0, "shapes"},
    ErrorModel{"keep", 2, 0, 0, "shapes"},
    ErrorModel{"fill-cavities", 2, 0, 0, "shapes"},
};
constexpr ErrorModel kUnmeasured{"", 1, 0.7, kEdge, ""};

/// Least radius of curvature of a shape, world units; 0 where its options do not tell.
double leastRadius(const Node& node) {
  const std::string& action = node.op->name;
  const char* option = action == "torus" ? "tube" : "radius";
  if (action != "sphere" && action != "capsule" && action != "cylinder" && action != "torus")
    return 0;
  try {
    return Invocation(*node.op, node.options).length(option);
  } catch (const levelset::UsageError&) {  // `%` or `vx`, and nothing yet to count on
    return 0;
  }
}

}  // namespace

const ErrorModel& errorModel(const std::string& action) {
  const auto it = std::find_if(kModels.begin(), kModels.end(),
                               [&](const ErrorModel& model) { return action == model.action; });
  return it == kModels.end() ? kUnmeasured : *it;
}

GraphModel graphModel(const Graph& graph, const std::vector<std::size_t>& nodes) {
  GraphModel all;
  for (const std::size_t i : nodes) {
    const ErrorModel& model = errorModel(graph.nodes[i].op->name);
    all.order = std::min(all.order, model.order);
    all.makesCreases = all.makesCreases || model.creaseConstant > 0;
    const auto isSame = [&](const char* name) { return std::string(name) == model.source; };
    if (*model.source && std::none_of(all.cases.begin(), all.cases.end(), isSame))
      all.cases.push_back(model.source);
  }
  return all;
}

double modelVoxelSize(const Node& node, double error) {
  const ErrorModel& model = errorModel(node.op->name);
  if (!(model.constant > 0)) return 0;
  if (model.order == 1) return error / model.constant;
  const double radius = leastRadius(node);
  return std::sqrt(error * radius / model.constant);
}

}  // namespace pipeline
