#include <fmt/core.h>

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "apps/pipeline/run/graph_run.h"
#include "apps/pipeline/run/planner.h"
#include "apps/pipeline/run/surface_spread.h"
#include "levelset/error.h"
#include "levelset/files/band_parts_writer.h"
#include "levelset/memory_limit.h"

namespace pipeline {
namespace {

using Imath::Box3d;
using Imath::Box3i;
using Imath::V3d;
using Imath::V3i;
using levelset::kPartCell;

/// Coordinate beyond every band, a multiple of kPartCell. The outermost parts extend to it, because
/// the planned bounds of a band are an estimate.
constexpr int kFarCell = 1 << 30;

/// Share of the available memory that a part may use, by the estimate before it is computed. The
/// rest is for the mesh, for the result's blocks and for the error of the estimate.
constexpr double kPartShare = 0.4;
/// Share of the available memory at which a part is given up, to be divided.
constexpr double kLargestShare = 0.9;

/// The box of an index box with half a voxel around its grid points, world units.
Box3d worldBox(const Box3i& cells, double voxelSize) {
  return {(V3d(cells.min) - V3d(0.5)) * voxelSize, (V3d(cells.max) + V3d(0.5)) * voxelSize};
}

/// Returns the part of the cells within `around`, for estimates: the outermost parts are unbounded.
Box3i within(const Box3i& cells, const Box3i& around) {
  Box3i result = cells;
  for (int axis = 0; axis < 3; ++axis) {
    result.min[axis] = std::max(cells.min[axis], around.min[axis]);
    result.max[axis] = std::min(cells.max[axis], around.max[axis]);
  }
  return result;
}

/// Halves a box of cells across its longest side. `around` bounds the band.
/// @return false if the box has a single cell
bool halve(const Box3i& cells, const Box3i& around, Box3i& low, Box3i& high) {
  const Box3i inner = within(cells, around);
  const V3i size = (inner.max - inner.min + V3i(1)) / kPartCell;
  int axis = 0;
  for (int other = 1; other < 3; ++other)
    if (size[other] > size[axis]) axis = other;
  if (size[axis] < 2) return false;
  low = high = cells;
  high.min[axis] = inner.min[axis] + size[axis] / 2 * kPartCell;
  low.max[axis] = high.min[axis] - 1;
  return true;
}

/// The smallest box of cells around a band, by its plan.
Box3i cellsAround(const Plan& plan) {
  Box3i cells;
  for (int axis = 0; axis < 3; ++axis) {
    const double rim = plan.halfWidth * plan.voxelSize;
    const auto cell = [&](double x) {
      return static_cast<int>(std::floor(x / plan.voxelSize / kPartCell));
    };
    cells.min[axis] = cell(plan.bounds.min[axis] - rim) * kPartCell;
    cells.max[axis] = (cell(plan.bounds.max[axis] + rim) + 1) * kPartCell - 1;
  }
  return cells;
}

/// Returns plans with bounds as narrow along x as those of parts. The estimates of operators that
/// sweep the grid along x depend on that extent.
std::vector<std::optional<Plan>> narrowPlans(std::vector<std::optional<Plan>> plans) {
  for (std::optional<Plan>& plan : plans)
    if (plan && plan->voxelSize > 0 && !plan->bounds.isEmpty())
      plan->bounds.max.x =
          std::min(plan->bounds.max.x, plan->bounds.min.x + kPartCell * plan->voxelSize);
  return plans;
}

/// Checks that the grid of a band is world = voxelSize × index. Parts are boxes of this grid.
void requirePlainGrid(const levelset::NarrowBand& band) {
  Imath::M44d plain;
  plain.setScale(V3d(band.voxelSize()));
  if (!band.indexToWorld().equalWithAbsError(plain, 1e-9 * band.voxelSize()))
    throw levelset::UsageError(
        "the band does not fit into memory, and it cannot be computed in parts, because its grid "
        "is rotated or moved; raise --max-memory, or resample it first");
}

}  // namespace

/// Computes and writes the result part by part. Each part is a run of its own on a region of
/// interest.
/// @param write  node of the action that writes
void GraphRun::runInParts(std::size_t write) {
  const Node& node = graph_.nodes[write];
  const std::size_t result = node.inputs[0];
  const Plan& plan = *plans_[result];

  Graph graph = graph_;
  graph.nodes.resize(write);
  graph.results = {result};
  for (std::size_t i = 0; i < write; ++i) {
    if (graph.nodes[i].kind == Kind::Band || states_[i] == NodeState::Unneeded) continue;
    if (!values_.has(i)) compute(i);
    graph.given.emplace(i, values_.peek(i));
  }
  const std::vector<char> runs = neededNodes(graph);
  const auto available = static_cast<double>(levelset::memoryLeft(settings_.maxMemory));
  const std::size_t inUse = levelset::residentBytes();
  // Memory is in proportion to the surface in a part.
  double budget = kPartShare * available;
  const double whole =
      estimatePeak(graph, runs, narrowPlans(plans_), regionsOfInterest(graph, runs, plans_));
  std::size_t first = 0;
  while (graph.nodes[first].kind != Kind::Band || !runs[first]) ++first;
  const ShareOfBox share = shareOfBox(graph, first, *plans_[first]);

  Invocation writing(*node.op, node.options);
  levelset::WriteBandOptions options{.name = writing.text("name"),
                                     .format = writing.text("format")};
  options.progress = [&](double fraction) {
    if (settings_.progress) settings_.progress(write, node.op->name, fraction);
    return !settings_.shouldContinue || settings_.shouldContinue();
  };
  const std::string name = node.op->name;
  std::optional<levelset::BandPartsWriter> file;
  levelset::withContext(name, [&] { file.emplace(writing.text("file"), options); });
  RunSettings settings = settings_;
  settings.measureErrors = false;
  settings.thumbnails = 0;
  // The allocator keeps what an action has released, and the memory limit counts it.
  settings.begin = [&](const std::string& action) {
    malloc_trim(0);
    if (settings_.begin) settings_.begin(action);
  };
  std::set<std::string> told;
  settings.warn = [&](const std::string& text) {
    if (told.insert(text).second) settings_.warn(text);
  };
  settings.note = [&](const std::string& text) {
    if (told.insert(text).second) settings_.note(text);
  };

  // Gives up a part that takes more than its estimate, before the limit ends the process.
  bool canSplit = false;
  const double most = static_cast<double>(inUse) + kLargestShare * available;
  settings.shouldContinue = [&] {
    if (canSplit &&
        inUse<settings_.maxMemory&& static_cast<double>(levelset::residentBytes())> most)
      throw levelset::ResourceLimit("the part does not fit into memory");
    return !settings_.shouldContinue || settings_.shouldContinue();
  };

  const Box3i around = cellsAround(plan);
  std::vector<Box3i> parts{{V3i(-kFarCell), V3i(kFarCell - 1)}};
  std::size_t count = 0;
  std::exception_ptr nothing;
  while (!parts.empty()) {
    const Box3i part = parts.back();
    parts.pop_back();
    Box3i low, high;
    canSplit = halve(part, around, low, high);
    const auto split = [&] { parts.insert(parts.end(), {high, low}); };
    const std::vector<RegionOfInterest> regions =
        regionsOfInterest(graph, runs, plans_, 1, worldBox(within(part, around), plan.voxelSize));
    const double estimate = whole * share(regions[first].region);
    if (canSplit && estimate > budget) {
      split();
      continue;
    }
    settings.part = worldBox(part, plan.voxelSize);
    RunReport report;
    try {
      const Value value = GraphRun(graph, settings, report).runPart(result);
      levelset::withContext(name, [&] {
        requirePlainGrid(value.band());
        file->add(value.band(), part);
      });
      ++count;
    } catch (const levelset::NoSurface&) {
      nothing = std::current_exception();  // the band does not reach this part
    } catch (const levelset::ResourceLimit&) {
      if (!canSplit) throw;
      budget = std::min(budget, estimate / 2);
      split();
    }
    malloc_trim(0);
    addSteps(report);
  }
  if (count == 0 && nothing) std::rethrow_exception(nothing);
  if (settings_.begin) settings_.begin(name);
  StepReport& step = begin(write);
  StepClock clock(step, running_);
  levelset::withContext(name, [&] { file->commit(); });
  clock.stop();
  step.activeVoxels = static_cast<double>(file->activeVoxelCount());
  for (std::size_t i = 0; i <= write; ++i)
    if (steps_[i] && !pendingOutput_[i]) queueOutput(i, "");
  reportInOrder();
  settings_.note(
      fmt::format("the result was computed in {} parts to stay within --max-memory", count));
}

/// Adds the steps of the run of a part to the steps of the complete run. Costs add up.
void GraphRun::addSteps(const RunReport& part) {
  std::size_t i = 0;
  for (const StepReport& step : part.steps) {
    while (i < graph_.nodes.size() &&
           (graph_.nodes[i].op->name != step.action || states_[i] == NodeState::Unneeded))
      ++i;
    if (i == graph_.nodes.size()) return;
    if (!steps_[i]) {
      steps_[i] = step;
      steps_[i]->roi = {};
      if (plans_[i]) steps_[i]->activeVoxels = plans_[i]->activeVoxels();  // parts overlap
    } else {
      steps_[i]->wallSeconds += step.wallSeconds;
      steps_[i]->cpuSeconds += step.cpuSeconds;
      steps_[i]->peakBytes = std::max(steps_[i]->peakBytes, step.peakBytes);
    }
    ++i;
  }
}

}  // namespace pipeline
