#include "levelset/eikonal/arrival.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "levelset/eikonal/arrival_blocks.h"
#include "levelset/eikonal/arrival_vdb.h"
#include "levelset/eikonal/distance_transform.h"
#include "levelset/eikonal/room.h"
#include "levelset/eikonal/signs.h"
#include "levelset/error.h"
#include "levelset/fields/grid_vdb.h"

namespace levelset {
namespace eikonal {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Index;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

// Second-order differences read two grid points back: that far the start is exact, voxels.
constexpr double kStartWidth = 2;
// The curvature of the front around a point is too much for differences up to here, voxels.
constexpr double kStartBall = 8;
constexpr double kBytesPerGridPoint = 24;

/// 1 / speed; kFar where nothing passes.
double slownessOf(double speed) {
  return speed > 0 && std::isfinite(speed) ? 1 / speed : static_cast<double>(kFar);
}

/// Time over a short straight way: Simpson's rule on the slowness. kFar when something is in the
/// way.
template <typename Slowness>
float shortTime(const Vec3d& from, const Vec3d& to, const Slowness& slowness) {
  const double a = slowness(from), b = slowness((from + to) / 2), c = slowness(to);
  if (!(std::max({a, b, c}) < static_cast<double>(kFar))) return kFar;
  return static_cast<float>((to - from).length() * (a + 4 * b + c) / 6);
}

class Solver {
 public:
  Solver(const ArrivalRequest& request, const openvdb::math::Transform& transform,
         const FloatTree* side)
      : request_(request), transform_(transform), side_(side) {
    ArrivalBlocks::Settings settings;
    settings.action = request.action;
    settings.until = request.until / transform.voxelSize()[0];
    if (request.options.speed)
      settings.slowness = [this](const Coord& c) { return slownessAt(c.asVec3d()); };
    settings.side = side;
    settings.maxMemory = request.options.maxMemory;
    settings.progress = subProgress(request.options.progress, 0.1, 1);
    blocks_ = std::make_unique<ArrivalBlocks>(settings);
  }

  [[nodiscard]] double slownessAt(const Vec3d& index) const {
    return request_.options.speed
               ? slownessOf(request_.options.speed(toImath(transform_.indexToWorld(index))))
               : 1;
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
  /// The grid points that makeLeaf() gives a time: a start may come too late for one.
  [[nodiscard]] ArrivalBlock::Mask reachedOf(const ArrivalBlock& block) const {
    const auto voxelSize = static_cast<float>(transform_.voxelSize()[0]);
    ArrivalBlock::Mask reached = block.known;
    for (auto it = block.known.beginOn(); it; ++it)
      if (!(block.time[it.pos()] * voxelSize < static_cast<float>(request_.until)))
        reached.setOff(it.pos());
    return reached;
  }

  FloatGrid::Ptr makeGrid() const {
    const double voxelSize = transform_.voxelSize()[0];
    const auto background = static_cast<float>(request_.until);
    const auto tree = std::make_shared<FloatTree>(background);
    if (side_)
      copySigns(
          *side_, [&](const Coord& origin) { return blocks_->holds(origin); }, *tree);
    std::vector<std::unique_ptr<LeafNode>> leaves(blocks_->blocks().size());
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t i) {
      leaves[i] = makeLeaf(blocks_->blocks()[i], static_cast<float>(voxelSize), background);
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

  static std::unique_ptr<LeafNode> makeLeaf(const ArrivalBlock& block, float voxelSize,
                                            float background) {
    auto leaf = std::make_unique<LeafNode>(block.origin, background, false);
    for (Index n = 0; n < ArrivalBlock::kSize; ++n) {
      const bool inside = block.inside.isOn(n);
      const float time = block.time[n] * voxelSize;
      if (block.known.isOn(n) && time < background)
        leaf->setValueOn(n, inside ? std::min(-time, -1e-7f * voxelSize) : time);
      else if (inside)
        leaf->setValueOnly(n, -background);
    }
    return leaf;
  }

  const ArrivalRequest& request_;
  const openvdb::math::Transform& transform_;
  const FloatTree* side_;
  std::unique_ptr<ArrivalBlocks> blocks_;
};

/// The grid points beside the surface and their times.
std::vector<StartTime> surfaceStart(const FloatGrid& field, const ArrivalRequest& request,
                                    const Solver& solver) {
  DistanceRequest near;
  near.action = request.action;
  near.halfWidth = kStartWidth;
  near.maxMemory = request.options.maxMemory;
  near.progress = subProgress(request.options.progress, 0, 0.1);
  const double inverse = 1 / field.voxelSize()[0];
  std::vector<StartTime> start;
  if (!request.options.speed) {
    const FloatGrid::Ptr distance = distanceTransform(field, near);
    for (auto it = distance->cbeginValueOn(); it; ++it)
      start.push_back({it.getCoord(), static_cast<float>(std::abs(*it) * inverse)});
    return start;
  }
  const auto slowness = [&](const Vec3d& p) { return solver.slownessAt(p); };
  const auto times = std::make_shared<FloatTree>(kFar);
  std::mutex mutex;
  near.visitPoints = [&](const LeafNode& leaf, const ClosestPointLeaf& points) {
    auto part = std::make_unique<LeafNode>(leaf.origin(), kFar, false);
    for (auto it = leaf.cbeginValueOn(); it; ++it)
      part->setValueOn(it.pos(), shortTime(points[it.pos()], it.getCoord().asVec3d(), slowness));
    const std::lock_guard lock(mutex);
    times->addLeaf(part.release());
  };
  const FloatGrid::Ptr distance = distanceTransform(field, near);
  for (auto it = times->cbeginValueOn(); it; ++it) start.push_back({it.getCoord(), *it});
  return start;
}

void checkRoom(const std::vector<StartTime>& start, const FloatGrid& field,
               const ArrivalRequest& request) {
  // How far another speed goes is seen on the way, block by block.
  if (request.options.speed) return;
  Room room;
  for (const StartTime& s : start) room.surface.expand(s.gridPoint);
  room.area = static_cast<double>(start.size()) / (2 * kStartWidth);
  room.inside = room.outside = request.until / field.voxelSize()[0];
  room.bytesPerGridPoint = kBytesPerGridPoint;
  requireRoom(room, request.options.maxMemory, request.action);
}

}  // namespace

ArrivalGrid arrivalFromSurface(const FloatGrid& field, const ArrivalRequest& request) {
  Solver solver(request, field.transform(), &field.tree());
  const std::vector<StartTime> start = surfaceStart(field, request, solver);
  checkRoom(start, field, request);
  return solver.run(start);
}

ArrivalGrid arrivalFromPoints(std::span<const Imath::V3d> sources,
                              const openvdb::math::Transform& transform,
                              const ArrivalRequest& request) {
  Solver solver(request, transform, nullptr);
  std::vector<StartTime> start;
  const auto slowness = [&](const Vec3d& p) { return solver.slownessAt(p); };
  const int reach = static_cast<int>(kStartBall) + 1;
  for (const Imath::V3d& source : sources) {
    const Vec3d p = transform.worldToIndex(toVdb(source));
    for (int i = 0; i < 3; ++i)
      if (!(std::abs(p[i]) < kIndexLimit))
        throw ResourceLimit(
            fmt::format("{}: a point lies {:.4g} voxels from the origin, beyond the range of "
                        "32-bit indices; use larger voxels",
                        request.action, std::abs(p[i])));
    const Coord centre = Coord::round(p);
    for (int x = -reach; x <= reach; ++x)
      for (int y = -reach; y <= reach; ++y)
        for (int z = -reach; z <= reach; ++z) {
          const Coord c = centre.offsetBy(x, y, z);
          if ((c.asVec3d() - p).length() > kStartBall) continue;
          start.push_back({c, shortTime(p, c.asVec3d(), slowness)});
        }
  }
  return solver.run(start);
}

}  // namespace eikonal

namespace {

eikonal::ArrivalRequest checkedRequest(double until, const ArrivalOptions& options) {
  eikonal::ArrivalRequest request;
  request.action = options.method == FrontMethod::Marching ? "march" : "sweep";
  request.until = until;
  request.options = options;
  if (!std::isfinite(until) || until <= 0)
    throw UsageError(
        fmt::format("{}: the latest time is {}; give a positive one", request.action, until));
  if (options.order != 1 && options.order != 2)
    throw UsageError(
        fmt::format("{}: the order is {}; give 1 or 2", request.action, options.order));
  return request;
}

void requireSolid(const NarrowBand& solid, const char* action) {
  if (solid.isEmpty())
    throw InvalidInput(
        fmt::format("{}: the solid is empty, so no front can start on it; give a solid", action));
}

ArrivalTimes asField(eikonal::ArrivalGrid result, const char* action) {
  result.times->setName("time");
  return {importField(result.times, action), result.figures};
}

}  // namespace

ArrivalTimes arrivalTimes(const NarrowBand& solid, double until, const ArrivalOptions& options) {
  const eikonal::ArrivalRequest request = checkedRequest(until, options);
  requireSolid(solid, request.action);
  eikonal::ArrivalGrid result = eikonal::arrivalFromSurface(vdb(solid), request);
  result.times->setGridClass(openvdb::GRID_UNKNOWN);
  return asField(std::move(result), request.action);
}

ArrivalTimes arrivalTimesFromPoints(const NarrowBand& lattice, std::span<const Imath::V3d> sources,
                                    double until, const ArrivalOptions& options) {
  const eikonal::ArrivalRequest request = checkedRequest(until, options);
  if (!lattice.shared())
    throw UsageError(fmt::format("{}: there is no grid to work on; give a solid", request.action));
  if (sources.empty())
    throw UsageError(fmt::format("{}: there is no point to start from; give one", request.action));
  for (const Imath::V3d& p : sources)
    for (int i = 0; i < 3; ++i)
      if (!std::isfinite(p[i]))
        throw UsageError(
            fmt::format("{}: a point to start from has the coordinate {}; give finite "
                        "points",
                        request.action, p[i]));
  return asField(eikonal::arrivalFromPoints(sources, vdb(lattice).transform(), request),
                 request.action);
}

FrontDistance frontDistance(const NarrowBand& solid, double reach, const ArrivalOptions& options) {
  const eikonal::ArrivalRequest request = checkedRequest(reach, options);
  requireSolid(solid, request.action);
  if (options.speed)
    throw UsageError(
        fmt::format("{}: at another speed than 1 times are no distances; ask for arrival times",
                    request.action));
  if (reach < solid.voxelSize())
    throw UsageError(fmt::format("{}: the reach is {} voxels; give at least 1", request.action,
                                 reach / solid.voxelSize()));
  eikonal::ArrivalGrid result = eikonal::arrivalFromSurface(vdb(solid), request);
  return {makeBand(std::move(result.times)), result.figures};
}

}  // namespace levelset
