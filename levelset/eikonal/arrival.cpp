#include "levelset/eikonal/arrival.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/distance/signs.h"
#include "levelset/eikonal/arrival_start.h"
#include "levelset/eikonal/arrival_vdb.h"
#include "levelset/eikonal/fast_marching.h"
#include "levelset/eikonal/fast_sweeping.h"
#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"
#include "levelset/memory/memory_estimate.h"

namespace levelset {
namespace eikonal {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Index;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

constexpr double kBytesPerGridPoint = 24;
// Smallest depth of an inside grid point, voxels. The negative time of an inside grid point is at
// least the time for this depth in magnitude, so the point stays inside when its time rounds to
// zero.
constexpr double kLeastDepth = 1e-7;
// Fraction of the reported progress at which all start times are computed.
constexpr double kStarted = 0.1;

/// Returns the slowness, 1 / speed, as a function of index positions; kFar where the front cannot
/// pass. Returns an empty function when no speed is set: the speed is 1 everywhere.
Slowness slownessOf(const ScalarField& speed, const openvdb::math::Transform& transform) {
  if (!speed) return {};
  return [&](const Vec3d& index) {
    const double here = speed(toImath(transform.indexToWorld(index)));
    return here > 0 && std::isfinite(here) ? 1 / here : static_cast<double>(kFar);
  };
}

Slowness scaled(const Slowness& slowness, double unit) {
  if (!slowness) return {};
  return [=](const Vec3d& index) {
    const double here = slowness(index);
    return here < static_cast<double>(kFar) ? here / unit : static_cast<double>(kFar);
  };
}

class Solver {
 public:
  /// @param slowness  slowness divided by `unit`; empty: 1 everywhere
  /// @param sources  source points, index space; empty: the front starts at the surface of `side`
  /// @param unit  typical slowness, by which times are scaled. At typical speed, scaled times are
  /// distances in voxels.
  Solver(const ArrivalRequest& request, const openvdb::math::Transform& transform,
         const FloatTree* side, std::vector<Vec3d> sources, const Slowness& slowness, double unit)
      : request_(request),
        transform_(transform),
        side_(side),
        voxelTime_(unit * transform.voxelSize()[0]) {
    ArrivalBlocks::Settings settings;
    settings.until = request.until / voxelTime_;
    if (slowness) settings.slowness = [=](const Coord& c) { return slowness(c.asVec3d()); };
    settings.side = side;
    if (!sources.empty()) {
      std::vector<double> there;
      for (const Vec3d& source : sources) there.push_back(slowness ? slowness(source) : 1);
      settings.sources = std::make_shared<PointSources>(std::move(sources), std::move(there));
    }
    settings.maxMemory = request.options.maxMemory;
    settings.progress = subProgress(request.options.progress, kStarted, 1);
    blocks_ = std::make_unique<ArrivalBlocks>(settings);
  }

  ArrivalGrid run(const std::vector<StartTime>& start) {
    blocks_->start(start);
    const int order = request_.options.order;
    ArrivalGrid result;
    for (const ArrivalBlock& block : blocks_->blocks())
      result.figures.started += block.known.countOn();
    request_.options.method == FrontMethod::Marching ? marchArrivals(*blocks_, order)
                                                     : sweepArrivals(*blocks_, order);
    for (const ArrivalBlock& block : blocks_->blocks()) {
      const ArrivalBlock::Mask reached = reachedOf(block);
      result.figures.reached += reached.countOn();
      result.figures.firstOrder += (block.firstOrder & reached).countOn();
    }
    result.times = makeGrid();
    return result;
  }

 private:
  [[nodiscard]] float timeOf(const ArrivalBlock& block, Index n) const {
    return static_cast<float>(static_cast<double>(block.time[n]) * voxelTime_);
  }

  /// Returns the grid points of a block whose times makeLeaf() stores. Leaves out times of `until`
  /// or later, which a start time may have.
  [[nodiscard]] ArrivalBlock::Mask reachedOf(const ArrivalBlock& block) const {
    ArrivalBlock::Mask reached = block.known;
    for (auto it = block.known.beginOn(); it; ++it)
      if (!(timeOf(block, it.pos()) < static_cast<float>(request_.until))) reached.setOff(it.pos());
    return reached;
  }

  FloatGrid::Ptr makeGrid() const {
    const auto background = static_cast<float>(request_.until);
    const auto tree = std::make_shared<FloatTree>(background);
    if (side_)
      copySigns(
          *side_, [&](const Coord& origin) { return blocks_->holds(origin); }, *tree);
    std::vector<std::unique_ptr<LeafNode>> leaves(blocks_->blocks().size());
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
      leaves[i] = makeLeaf(blocks_->blocks()[i], background);
    });
    for (std::unique_ptr<LeafNode>& leaf : leaves) {
      float tile = 0;
      bool isOn = false;
      if (leaf->isConstant(tile, isOn) && !isOn)
        tree->addTile(1, leaf->origin(), tile, false);
      else
        tree->addLeaf(leaf.release());
    }
    openvdb::tools::pruneTiles(*tree);
    FloatGrid::Ptr grid = FloatGrid::create(tree);
    grid->setTransform(transform_.copy());
    if (side_ && !request_.options.speed) grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
  }

  [[nodiscard]] std::unique_ptr<LeafNode> makeLeaf(const ArrivalBlock& block,
                                                   float background) const {
    auto leaf = std::make_unique<LeafNode>(block.origin, background, false);
    for (Index n = 0; n < ArrivalBlock::kSize; ++n) {
      const bool inside = block.inside.isOn(n);
      const float time = timeOf(block, n);
      const auto least = static_cast<float>(kLeastDepth * block.slownessAt(n) * voxelTime_);
      if (block.known.isOn(n) && time < background)
        leaf->setValueOn(n, inside ? std::min(-time, -least) : time);
      else if (inside)
        leaf->setValueOnly(n, -background);
    }
    return leaf;
  }

  const ArrivalRequest& request_;
  const openvdb::math::Transform& transform_;
  const FloatTree* side_;
  double voxelTime_;  ///< time that the front takes for a voxel at the typical speed
  std::unique_ptr<ArrivalBlocks> blocks_;
};

void checkMemoryFor(const std::vector<StartTime>& start, const FloatGrid& field,
                    const ArrivalRequest& request) {
  // With a user-defined speed, the extent of the front is not known in advance.
  // ArrivalBlocks::touch() then checks the memory block by block.
  if (request.options.speed) return;
  MemoryEstimate estimate;
  for (const StartTime& s : start) estimate.surface.expand(s.gridPoint);
  estimate.area = static_cast<double>(start.size()) / (2 * kStartWidth);
  estimate.inside = estimate.outside = request.until / field.voxelSize()[0];
  estimate.bytesPerGridPoint = kBytesPerGridPoint;
  checkMemory(estimate, request.options.maxMemory);
}

ArrivalStart startOf(const ArrivalRequest& request, const Slowness& slowness) {
  return {.slowness = slowness,
          .maxMemory = request.options.maxMemory,
          .progress = subProgress(request.options.progress, 0, kStarted)};
}

/// Converts source points to index positions.
/// @throws ResourceLimit when an index does not fit into 32 bits
std::vector<Vec3d> positionsOf(std::span<const Imath::V3d> sources,
                               const openvdb::math::Transform& transform) {
  std::vector<Vec3d> positions;
  for (const Imath::V3d& source : sources) {
    positions.push_back(transform.worldToIndex(toVdb(source)));
    for (int i = 0; i < 3; ++i)
      if (!(std::abs(positions.back()[i]) < kIndexLimit))
        throw ResourceLimit(
            fmt::format("a source point lies {:.4g} voxels from the origin, beyond the range of "
                        "32-bit indices; use larger voxels",
                        std::abs(positions.back()[i])));
  }
  return positions;
}

}  // namespace

ArrivalGrid arrivalFromSurface(const FloatGrid& field, const ArrivalRequest& request) {
  const Slowness world = slownessOf(request.options.speed, field.transform());
  const double unit = world ? typicalSlowness(field, world) : 1;
  const Slowness slowness = scaled(world, unit);
  const std::vector<StartTime> start = startAtSurface(field, startOf(request, slowness));
  checkMemoryFor(start, field, request);
  return Solver(request, field.transform(), &field.tree(), {}, slowness, unit).run(start);
}

ArrivalGrid arrivalFromPoints(std::span<const Imath::V3d> sources,
                              const openvdb::math::Transform& transform,
                              const ArrivalRequest& request) {
  const std::vector<Vec3d> positions = positionsOf(sources, transform);
  const Slowness world = slownessOf(request.options.speed, transform);
  const double unit = world ? typicalSlowness(positions, world) : 1;
  const Slowness slowness = scaled(world, unit);
  const std::vector<StartTime> start = startAtPoints(positions, startOf(request, slowness));
  return Solver(request, transform, nullptr, positions, slowness, unit).run(start);
}

}  // namespace eikonal

namespace {

eikonal::ArrivalRequest checkedRequest(double until, const ArrivalOptions& options) {
  eikonal::ArrivalRequest request;
  request.until = until;
  request.options = options;
  if (!std::isfinite(until) || until <= 0)
    throw UsageError(fmt::format("the latest time is {}; give a positive, finite time", until));
  if (options.order != 1 && options.order != 2)
    throw UsageError(fmt::format("the order of the differences is {}; give 1 or 2", options.order));
  return request;
}

void requireStart(const NarrowBand& solid) {
  requireSolid(solid);
  if (solid.isEmpty())
    throw InvalidInput("the solid is empty, so no front can start on it; give a solid");
}

ArrivalTimes asField(eikonal::ArrivalGrid result) {
  result.times->setName("time");
  return {importField(result.times), result.figures};
}

}  // namespace

ArrivalTimes arrivalTimes(const NarrowBand& solid, double until, const ArrivalOptions& options) {
  const eikonal::ArrivalRequest request = checkedRequest(until, options);
  requireStart(solid);
  eikonal::ArrivalGrid result = eikonal::arrivalFromSurface(vdb(solid), request);
  result.times->setGridClass(openvdb::GRID_UNKNOWN);
  return asField(std::move(result));
}

ArrivalTimes arrivalTimesFromPoints(const NarrowBand& lattice, std::span<const Imath::V3d> sources,
                                    double until, const ArrivalOptions& options) {
  const eikonal::ArrivalRequest request = checkedRequest(until, options);
  if (!lattice.shared())
    throw UsageError("there is no grid on which to compute arrival times; give a solid");
  if (sources.empty()) throw UsageError("there is no source point; give at least one");
  for (const Imath::V3d& p : sources)
    for (int i = 0; i < 3; ++i)
      if (!std::isfinite(p[i]))
        throw UsageError(
            fmt::format("a source point has the coordinate {}; give finite "
                        "points",
                        p[i]));
  return asField(eikonal::arrivalFromPoints(sources, vdb(lattice).transform(), request));
}

FrontDistance frontDistance(const NarrowBand& solid, double reach, const ArrivalOptions& options) {
  const eikonal::ArrivalRequest request = checkedRequest(reach, options);
  requireStart(solid);
  if (options.speed)
    throw UsageError(
        "with a speed other than 1, arrival times are not distances; request "
        "arrival times");
  if (reach < solid.voxelSize())
    throw UsageError(fmt::format("the largest distance is {} voxels; give at least 1",
                                 reach / solid.voxelSize()));
  eikonal::ArrivalGrid result = eikonal::arrivalFromSurface(vdb(solid), request);
  return {makeBand(std::move(result.times)), result.figures};
}

}  // namespace levelset
