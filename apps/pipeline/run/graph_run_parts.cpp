#include <fmt/core.h>

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "apps/pipeline/run/graph_run.h"
#include "apps/pipeline/run/planner.h"
#include "apps/pipeline/run/surface_spread.h"
#include "levelset/distance/sweep_width.h"
#include "levelset/error.h"
#include "levelset/files/band_parts_writer.h"
#include "levelset/memory/memory_limit.h"

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
/// estimate holds for surfaces with edges everywhere. kLeastPartShare holds where the blocks that
/// are written take most of the memory. kLeastRatio is the least ratio of the memory
/// of a part to its estimate that counts for the parts after it; kRatioMargin is its error.
constexpr double kPartShare = 0.75, kLeastPartShare = 0.2, kLeastRatio = 0.5, kRatioMargin = 1.3;
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

/// Halves a box of cells across an axis. `around` bounds the band.
/// @return false if the box has a single cell along the axis
bool halve(const Box3i& cells, const Box3i& around, int axis, Box3i& low, Box3i& high) {
  const Box3i inner = within(cells, around);
  const int size = (inner.max[axis] - inner.min[axis] + 1) / kPartCell;
  if (size < 2) return false;
  low = high = cells;
  high.min[axis] = inner.min[axis] + size / 2 * kPartCell;
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

/// Returns plans of bands that hold a share of the surface, in bounds of at most `extent` voxels
/// along x. The estimates of operators that sweep the grid along x depend on that extent.
std::vector<std::optional<Plan>> plansOfPart(std::vector<std::optional<Plan>> plans, double share,
                                             double extent) {
  for (std::optional<Plan>& plan : plans) {
    if (!plan || plan->kind != Kind::Band || !(plan->voxelSize > 0) || plan->bounds.isEmpty())
      continue;
    plan->area *= share;
    plan->bounds.max.x =
        std::min(plan->bounds.max.x, plan->bounds.min.x + extent * plan->voxelSize);
  }
  return plans;
}

/// Part of the result.
struct Part {
  Box3i cells;          ///< grid points
  double estimate = 0;  ///< peak memory while it is computed, bytes
};

/// Estimates the peak memory of parts, and divides them. Memory is in proportion to the surface in
/// a part, but for distance transforms. These sweep along x, and have working memory in proportion
/// to the surface in a slab.
class PartEstimate {
 public:
  /// Keeps references to the first three parameters.
  /// @param first   first node that makes a band
  /// @param result  node of the result
  PartEstimate(const Graph& graph, const std::vector<char>& runs,
               const std::vector<std::optional<Plan>>& plans, std::size_t first, std::size_t result)
      : graph_(graph),
        runs_(runs),
        plans_(plans),
        first_(first),
        voxelSize_(plans[result]->voxelSize),
        around_(cellsAround(*plans[result])),
        shares_(surfaceShares(graph, first, *plans[first])),
        complete_(regionsOfInterest(graph, runs, plans)) {}

  [[nodiscard]] double operator()(const Box3i& cells) const {
    const Box3d box = worldBox(within(cells, around_), voxelSize_);
    const Box3d read = regionsOfInterest(graph_, runs_, plans_, 1, box)[first_].region;
    const double width = levelset::kSweepWidth * plans_[first_]->voxelSize;
    const double share = shares_.inBox(read), inSlab = shares_.inDensestSlab(read, width);
    // An evenly spread surface of this extent has as much surface in a slab.
    const double extent = levelset::kSweepWidth * (inSlab > 0 ? share / inSlab : 1);
    return estimatePeak(graph_, runs_, plansOfPart(plans_, share, extent), complete_);
  }

  /// Returns false for a single cell.
  [[nodiscard]] bool canHalve(const Part& part) const {
    Box3i low, high;
    return halve(part.cells, around_, 0, low, high) || halve(part.cells, around_, 1, low, high) ||
           halve(part.cells, around_, 2, low, high);
  }

  /// Halves a part across the axis for which the larger of the two estimates is the least.
  /// @pre canHalve()
  [[nodiscard]] std::pair<Part, Part> halves(const Part& part) const {
    std::pair<Part, Part> best;
    double least = INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
      Part low, high;
      if (!halve(part.cells, around_, axis, low.cells, high.cells)) continue;
      low.estimate = (*this)(low.cells);
      high.estimate = (*this)(high.cells);
      const double larger = std::max(low.estimate, high.estimate);
      if (larger >= least) continue;
      least = larger;
      best = {low, high};
    }
    return best;
  }

 private:
  const Graph& graph_;
  const std::vector<char>& runs_;
  const std::vector<std::optional<Plan>>& plans_;
  std::size_t first_;
  double voxelSize_;
  Box3i around_;
  SurfaceShares shares_;
  std::vector<RegionOfInterest> complete_;
};

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
  // The memory for the blocks that are written grows to its share while the parts are computed.
  const double full =
      std::max(kPartShare * (available - bytesForWriting(plan)), kLeastPartShare * available);
  double budget = full, limit = INFINITY, ratio = 0;
  std::size_t first = 0;
  while (graph.nodes[first].kind != Kind::Band || !runs[first]) ++first;
  const PartEstimate estimateOf(graph, runs, plans_, first, result);

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
  const bool isLimitOfProcess = inUse < settings_.maxMemory;
  std::atomic<std::size_t> highest = 0;  // memory of the process while a part is computed
  settings.shouldContinue = [&] {
    const std::size_t now = levelset::residentBytes();
    std::size_t last = highest;
    while (last < now && !highest.compare_exchange_weak(last, now)) continue;
    if (canSplit && isLimitOfProcess && static_cast<double>(now) > most)
      throw levelset::ResourceLimit("the part does not fit into memory");
    return !settings_.shouldContinue || settings_.shouldContinue();
  };

  std::vector<Part> parts{{{V3i(-kFarCell), V3i(kFarCell - 1)}}};
  parts.back().estimate = estimateOf(parts.back().cells);
  std::size_t count = 0;
  std::exception_ptr nothing;
  while (!parts.empty()) {
    const Part part = parts.back();
    parts.pop_back();
    canSplit = estimateOf.canHalve(part);
    const auto split = [&] {
      const auto [low, high] = estimateOf.halves(part);
      parts.insert(parts.end(), {high, low});
    };
    if (canSplit && part.estimate > budget) {
      split();
      continue;
    }
    settings.part = worldBox(part.cells, plan.voxelSize);
    RunReport report;
    const std::size_t before = levelset::residentBytes();
    highest = before;
    bool isWritten = false;
    try {
      const Value value = GraphRun(graph, settings, report).runPart(result);
      levelset::withContext(name, [&] {
        requirePlainGrid(value.band());
        file->add(value.band(), part.cells);
      });
      highest = std::max(highest.load(), levelset::residentBytes());
      isWritten = true;
      ++count;
    } catch (const levelset::NoSurface&) {
      nothing = std::current_exception();  // the band does not reach this part
    } catch (const levelset::ResourceLimit&) {
      if (!canSplit) throw;
      limit = std::min(limit, part.estimate / 2);
      split();
    }
    // Parts of the same surface are alike. Small parts and empty ones do not tell.
    if (isWritten && part.estimate > budget / 4) {
      ratio = std::max(ratio, kRatioMargin * static_cast<double>(highest - before) / part.estimate);
      budget = full / std::max(ratio, kLeastRatio);
    }
    budget = std::min(budget, limit);
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
  settings_.note(fmt::format("the result was computed in {} part{} to stay within --max-memory",
                             count, count == 1 ? "" : "s"));
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
