#include "apps/pipeline/run/graph_run.h"

#include <algorithm>

#include "apps/pipeline/run/planner.h"
#include "apps/process_cost.h"
#include "levelset/error.h"

namespace pipeline {
namespace {

/// Largest ratio of an operator's peak memory to the size of its operands and result, from the
/// peaks of run reports.
constexpr double kWorkingFactor = 4;

/// Limit for the meshes that are read or generated during planning, bytes.
constexpr double kMaxPlanningBytes = 1 << 28;

/// Half width, in voxels, that estimateError() reads of a band: the cells of the zero set and
/// their neighbour cells.
constexpr double kMeasuredHalfWidth = 4;

}  // namespace

/// Estimates the size of each value and finds its region of interest. Values that may be requested
/// again later, from the cache or from Python, stay complete.
void GraphRun::planNodes() {
  std::vector<char> runs(graph_.nodes.size());
  for (std::size_t i = 0; i < runs.size(); ++i) runs[i] = states_[i] == NodeState::Compute;
  if (settings_.dryRun) return;
  plans_ = planValues(graph_, runs, settings_.maxMemory, [&](std::size_t i) {
             return planFromMesh(i);
           }).plans;
  if (!settings_.fullValues && !cache_ && !settings_.onValue)
    regions_ = regionsOfInterest(graph_, runs, plans_,
                                 settings_.measureErrors ? kMeasuredHalfWidth : 1, settings_.part);
  if (std::any_of(regions_.begin(), regions_.end(),
                  [](const RegionOfInterest& roi) { return !roi.isWhole(); })) {
    const std::vector<char> isOverwritten = findOverwritten(graph_, runs);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (!runs[i] || !(isOverwritten[i] || readsOnce(graph_.nodes[i]))) continue;
      // The node cannot read its input again. Keep its complete value, in case a consumer is
      // retried on complete values.
      regions_[i] = {};
      values_.addUse(i);
    }
  }
  if (isLimited() && !settings_.fullValues && !cache_ && !settings_.onValue)
    partedWrite_ = findPartedWrite(graph_, runs, plans_, regions_, settings_.maxMemory);
  if (!partedWrite_) checkMemoryFor(graph_, runs, plans_, regions_, settings_.maxMemory);
}

/// Computes a mesh or a point cloud during planning if a band is computed from it. Their plan
/// requires the value itself. Does nothing if the values computed for planning already exceed the
/// limit.
std::optional<Plan> GraphRun::planFromMesh(std::size_t i) {
  const double most = std::min(kMaxPlanningBytes, static_cast<double>(settings_.maxMemory) / 8);
  const bool feedsBand = std::any_of(graph_.nodes.begin() + static_cast<std::ptrdiff_t>(i),
                                     graph_.nodes.end(), [&](const Node& node) {
                                       return node.makes() && node.kind == Kind::Band &&
                                              std::find(node.inputs.begin(), node.inputs.end(),
                                                        i) != node.inputs.end();
                                     });
  if (!feedsBand || planningBytes_ > most) return {};
  const std::size_t endBefore = reportEnd_;
  try {
    compute(i);
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (const levelset::Error&) {
    planningFailures_[i] = std::current_exception();  // rethrown when the node's turn comes
    states_[i] = NodeState::Compute;
    reportEnd_ = std::min(endBefore, i + 1);
    return {};
  }
  isComputedForPlan_[i] = 1;
  if (!values_.has(i)) return {};
  if (values_.peek(i).kind() == Kind::Points) {
    planningBytes_ += values_.peek(i).plan().bytes();
    return values_.peek(i).plan();
  }
  const levelset::TriMesh& mesh = values_.peek(i).mesh();
  planningBytes_ += static_cast<double>(mesh.positions.size() * sizeof(mesh.positions[0]) +
                                        mesh.triangles.size() * sizeof(mesh.triangles[0]));
  return values_.peek(i).plan();
}

/// Decides if the result or an operand of a node is restricted to a region of interest.
bool GraphRun::isRestricted(std::size_t i) const {
  const std::vector<std::size_t>& inputs = graph_.nodes[i].inputs;
  return !regions_[i].isWhole() ||
         std::any_of(inputs.begin(), inputs.end(),
                     [&](std::size_t input) { return !regions_[input].isWhole(); });
}

/// Removes the region of interest from a node and from all nodes that it depends on.
void GraphRun::requestFullValues(std::size_t i) {
  std::vector<char> isRequested(i + 1, 0);
  isRequested[i] = 1;
  for (std::size_t k = i + 1; k-- > 0;) {
    if (!isRequested[k]) continue;
    regions_[k] = {};
    for (const std::size_t input : graph_.nodes[k].inputs) {
      if (!regions_[input].isWhole()) values_.drop(input);
      isRequested[input] = 1;
    }
  }
}

/// Decides, from memory estimates, if a node fits into memory beside the running ones.
bool GraphRun::fitsInMemory(std::size_t i, const std::vector<std::size_t>& running) const {
  if (!isLimited()) return true;
  const std::optional<double> own = workingBytes(i);
  if (!own) return false;
  double bytes = apps::processStatusBytes("VmRSS:") + *own;
  for (const std::size_t other : running) {
    const std::optional<double> of = workingBytes(other);
    if (!of) return false;
    bytes += *of;
  }
  // The estimates are rough: leave half of the limit free.
  return bytes <= static_cast<double>(settings_.maxMemory) / 2;
}

/// Estimates the memory that a node takes while it runs, bytes; empty: unknown.
std::optional<double> GraphRun::workingBytes(std::size_t i) const {
  if (isGiven(i) || states_[i] == NodeState::Unneeded || isComputedForPlan_[i]) return 0;
  const Node& node = graph_.nodes[i];
  double bytes = 0;
  const auto add = [&](std::size_t of) {
    if (!plans_[of]) return false;
    bytes += kWorkingFactor * restricted(*plans_[of], regions_[of]).bytes();
    return true;
  };
  if (node.makes() && !add(i)) return {};
  if (!std::all_of(node.inputs.begin(), node.inputs.end(), add)) return {};
  for (const auto& [option, input] : node.named)
    if (!add(input)) return {};
  return bytes;
}

}  // namespace pipeline
