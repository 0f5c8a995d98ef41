#include "levelset/distance/distance_transform.h"

#include <fmt/core.h>
#include <malloc.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <optional>

#include "levelset/distance/moved/meeting_parts.h"
#include "levelset/distance/nearest/point_distance.h"
#include "levelset/distance/signs.h"
#include "levelset/error.h"
#include "levelset/memory/memory_estimate.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;
using Block = NearestPoints::Block;

/// Result for one block: a leaf, or the value of a tile if no grid point is in the band and all
/// have the same sign.
struct LeafOrTile {
  std::unique_ptr<LeafNode> leaf;
  float tile = 0;
};

/// Computes the distances of one block.
/// @param before  leaf of the input field; null where the field has none
LeafOrTile makeLeaf(const Block& block, const LeafNode* before, Polisher& polisher,
                    const DistanceRequest& request, double voxelSize, float background) {
  const double shift = request.shift;
  LeafOrTile result{std::make_unique<LeafNode>(block.origin, background, false)};
  std::unique_ptr<ClosestPointLeaf> points;
  if (request.visitPoints) points = std::make_unique<ClosestPointLeaf>();
  bool isOn = false;
  const NearestPoints::Mask near = nearBand(block, request);
  polisher.prepare(block, near);
  float* values = result.leaf->buffer().data();
  for (auto it = near.beginOff(); it; ++it)
    if (distanceAt(block, it.pos(), polisher, request).value < 0) values[it.pos()] = -background;
  for (auto it = near.beginOn(); it; ++it) {
    const openvdb::Index n = it.pos();
    auto [value, closest] = nearDistanceAt(block, n, polisher, request);
    if (points) (*points)[n] = closest->point;
    if (before && shift == 0 && before->isValueOn(n))
      value = keptOr(value, static_cast<double>(before->getValue(n)) / voxelSize, polisher,
                     block.nearest[n]);
    setDistance(*result.leaf, n, value, request.halfWidth, voxelSize, background);
  }
  if (points && !result.leaf->isEmpty()) request.visitPoints(*result.leaf, *points);
  if (result.leaf->isEmpty() && result.leaf->isConstant(result.tile, isOn)) result.leaf.reset();
  return result;
}

/// Returns the number of slabs on each side of a slab to which a distance extends.
int slabsWithin(double voxels) {
  return static_cast<int>(std::min(1e6, std::ceil(voxels / 8)));
}

/// Returns the last slab all of whose grid points have a lower x than given.
int lastSlabBelow(double x) {
  return static_cast<int>(std::floor(std::max(-1e9, x) / 8)) - 1;
}

/// Computes a distance transform slab by slab, in ascending order of x. A slab is a layer of leaf
/// blocks. Each step follows the step before it at the distance that it needs, so only the slabs
/// between the first step and the last one are in memory.
class DistanceSweep {
 public:
  /// @param owned  the tree of the field, if its leaves may be deleted; else null
  DistanceSweep(const FloatGrid& field, FloatTree* owned, const DistanceRequest& request);
  FloatGrid::Ptr run();

 private:
  void checkMemory() const;
  void findAllPoints();
  void findPoints(int slab);
  void makeLeaves(int slab);
  void copySignsOf(int slab);
  void follow(int final);
  void release();
  void releaseSurface();

  // Number of slabs that are resolved together, see MeetingParts::resolve(). The slabs beside them
  // are read again each time.
  static constexpr int kResolved = 2;

  const FloatGrid& field_;
  const DistanceRequest& request_;
  NearestPoints::Reach reach_;
  BlockSelection within_;
  FloatTree::Ptr thickened_;
  FloatTree* owned_;
  ZeroSet surface_;
  std::optional<SurfacePointSearch> search_;
  std::optional<NearestPoints> nearest_;
  std::optional<Polishers> polishers_;
  FloatGrid::Ptr result_;
  std::optional<MeetingParts> meeting_;
  std::map<int, std::vector<std::size_t>> pointBlocks_;     ///< blocks of search_, by slab
  std::map<int, std::vector<Coord>> inputLeaves_;           ///< origins, by slab
  int last_ = 0;                                            ///< last slab of the result
  int found_ = 0, made_ = 0, searched_ = 0, resolved_ = 0;  ///< last slab of each step
};

/// Returns free memory to the system. The allocator keeps the memory of large arrays, and the
/// memory of other steps comes on top of it.
void returnFreeMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

NearestPoints::Reach reachOf(const DistanceRequest& request) {
  return {std::max(0.0, request.halfWidth - request.shift),
          std::max(0.0, request.halfWidth + request.shift), request.region};
}

/// Returns the blocks in which surface points are searched.
BlockSelection blocksWithPoints(const NearestPoints::Reach& reach) {
  BlockSelection blocks{reach.region};
  if (blocks.box)
    blocks.box->expand(static_cast<int>(std::min(1e9, std::max(reach.inside, reach.outside) + 2)));
  return blocks;
}

DistanceSweep::DistanceSweep(const FloatGrid& field, FloatTree* owned,
                             const DistanceRequest& request)
    : field_(field),
      request_(request),
      reach_(reachOf(request)),
      within_(blocksWithPoints(reach_)),
      owned_(owned),
      surface_{field.constTreePtr(),
               request.mayHaveEdges
                   ? SharpPatches(field, within_, subProgress(request.progress, 0, 0.1))
                   : SharpPatches(),
               {}} {}

void DistanceSweep::checkMemory() const {
  MemoryEstimate estimate;
  estimate.surface = search_->bounds();
  // There are at least 1.15 surface points for each voxel² of the surface.
  estimate.area = static_cast<double>(search_->size()) / 1.15;
  estimate.inside = reach_.inside;
  estimate.outside = reach_.outside;
  estimate.region = request_.region;
  // Bytes for the state of propagate.h and the result, including unused grid points in the blocks.
  estimate.bytesPerGridPoint = 25;
  eikonal::checkMemory(estimate, request_.maxMemory);
}

/// Finds the surface points of a slab and gives them to their grid points.
void DistanceSweep::findPoints(int slab) {
  if (const auto blocks = pointBlocks_.find(slab); blocks != pointBlocks_.end()) {
    const auto gridPoints = search_->find(blocks->second, surface_.points);
    for (std::size_t i = 0; i < gridPoints.size(); ++i)
      nearest_->seed(gridPoints[i], search_->first(blocks->second[i]));
  }
  nearest_->seedFeatures(search_->countOfGridPoints(), slab);
}

/// Finds the surface points of all slabs, because those at the boundary of a region depend on all.
void DistanceSweep::findAllPoints() {
  std::vector<std::size_t> all(search_->blockCount());
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<Coord> gridPoints;
  for (const std::vector<Coord>& part : search_->find(all, surface_.points))
    gridPoints.insert(gridPoints.end(), part.begin(), part.end());
  nearest_->seed(gridPoints, 0);
  nearest_->seedFeatures(gridPoints.size());
  nearest_->seedRegionBoundary(gridPoints);
}

void DistanceSweep::copySignsOf(int slab) {
  const auto leaves = inputLeaves_.find(slab);
  if (leaves == inputLeaves_.end()) return;
  for (const Coord& origin : leaves->second)
    if (!nearest_->find(origin))
      copyLeafSigns(*field_.tree().probeConstLeaf(origin), result_->tree());
}

/// Computes the distances of a slab.
void DistanceSweep::makeLeaves(int slab) {
  copySignsOf(slab);
  std::vector<Block*> blocks = nearest_->blocksOf(slab);
  // Blocks in a square of 4² blocks follow each other, so that the dense copies of their
  // surroundings are used again.
  std::sort(blocks.begin(), blocks.end(), [](const Block* a, const Block* b) {
    const Coord squareA = a->origin & ~31, squareB = b->origin & ~31;
    return squareA != squareB ? squareA < squareB : a->origin < b->origin;
  });
  std::vector<LeafOrTile> leaves(blocks.size());
  const float background = result_->background();
  polishers_->forEach(blocks.size(), [&](std::size_t i, Polisher& polisher) {
    leaves[i] = makeLeaf(*blocks[i], field_.tree().probeConstLeaf(blocks[i]->origin), polisher,
                         request_, field_.voxelSize()[0], background);
    blocks[i]->squared.release();
  });
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (leaves[i].leaf)
      result_->tree().addLeaf(leaves[i].leaf.release());
    else
      result_->tree().addTile(1, blocks[i]->origin, leaves[i].tile, false);
  }
}

/// Runs the steps after the propagation.
/// @param final  last slab for which the propagation is complete
void DistanceSweep::follow(int final) {
  const bool isEnd = final >= last_;
  // A block reads the nearest surface points of its neighbours.
  const int make = isEnd ? last_ : final - 1;
  while (made_ < make) makeLeaves(++made_);
  if (!meeting_) return;
  const int search =
      isEnd ? last_
            : std::min(make - 1, final - slabsWithin(MeetingParts::reachOfSearch(request_)));
  while (searched_ < search) {
    const auto blocks = nearest_->blocksOf(++searched_);
    meeting_->search(searched_, {blocks.begin(), blocks.end()});
  }
  const int resolve = isEnd ? last_ : searched_ - CreaseDistances::kSlabsAround;
  while (resolved_ + kResolved <= resolve) {
    meeting_->resolve(resolved_ + 1, resolved_ + kResolved);
    resolved_ += kResolved;
  }
  if (isEnd && resolved_ < last_) meeting_->resolve(resolved_ + 1, last_);
}

/// Releases the slabs that no step reads any more.
void DistanceSweep::release() {
  // Newton's method for the distance of a grid point starts at the nearest surface point of a
  // neighbour and moves by at most eight voxels. It reads a leaf and four grid points beside it.
  const double reach = std::max(reach_.inside, reach_.outside) + 2;
  int blocks = made_ - 1, field = blocks - slabsWithin(reach + 8 + 7 + DenseBlock::kPad);
  if (meeting_) {
    // Searches start again from grid points within kCreaseReach of the slabs that are not resolved.
    const double from = 8.0 * (resolved_ + 1) - kCreaseReach;
    blocks = std::min(blocks, lastSlabBelow(from - MeetingParts::reachOfSearch(request_)));
    field = std::min(field, lastSlabBelow(from - MeetingParts::fieldReachOfSearch(request_)));
  }
  const int points = blocks - slabsWithin(reach);
  field = std::min(field, points);
  nearest_->releaseUpTo(blocks);
  for (; !pointBlocks_.empty() && pointBlocks_.begin()->first <= points;
       pointBlocks_.erase(pointBlocks_.begin())) {
    // Blocks of a slab with successive numbers are released together.
    const std::vector<std::size_t>& all = pointBlocks_.begin()->second;
    for (std::size_t i = 0; i < all.size();) {
      std::size_t end = i + 1;
      while (end < all.size() && all[end] == all[end - 1] + 1) ++end;
      const std::size_t first = search_->first(all[i]), last = search_->first(all[end - 1] + 1);
      surface_.points.positions.release(first, last);
      surface_.points.jets.release(first, last);
      surface_.points.sharp.release(first, last);
      i = end;
    }
  }
  const auto deleteFrom = [&](FloatTree& tree, const Coord& origin) {
    if (tree.probeConstLeaf(origin)) tree.addTile(1, origin, tree.background(), false);
  };
  if (!owned_ && !thickened_) return;
  if (inputLeaves_.empty() || inputLeaves_.begin()->first > field) return;
  for (; !inputLeaves_.empty() && inputLeaves_.begin()->first <= field;
       inputLeaves_.erase(inputLeaves_.begin()))
    for (const Coord& origin : inputLeaves_.begin()->second) {
      if (owned_) deleteFrom(*owned_, origin);
      if (thickened_) deleteFrom(*thickened_, origin);
    }
  // Accessors keep pointers to leaves.
  if (owned_) owned_->clearAllAccessors();
  if (thickened_) thickened_->clearAllAccessors();
}

/// Releases everything that the last step, MeetingParts::finish(), does not read.
void DistanceSweep::releaseSurface() {
  nearest_.reset();
  search_.reset();
  surface_.patches.clear();
  surface_.points = {};
  pointBlocks_.clear();
  returnFreeMemory();
}

FloatGrid::Ptr DistanceSweep::run() {
  if (!surface_.patches.isEmpty()) returnFreeMemory();
  search_.emplace(*surface_.interpolated, within_, surface_.patches);
  if (!search_->thin().empty()) {
    thickened_ = thicken(field_.tree(), search_->thin());
    surface_.interpolated = thickened_;
    search_.emplace(*surface_.interpolated, within_, surface_.patches);
  }
  if (search_->size() == 0)
    throw NoSurface(
        fmt::format("the field has no zero crossing{}, so there is no surface to "
                    "measure from; give a solid with a surface",
                    within_.box ? " near the region" : ""));
  checkMemory();
  report(request_.progress, 0.1);

  surface_.points = search_->reserve();
  nearest_.emplace(field_.tree(), surface_.points, reach_);
  polishers_.emplace(surface_);
  result_ = FloatGrid::create(backgroundOf(request_.halfWidth, field_.voxelSize()[0]));
  result_->setTransform(field_.transform().copy());
  copyTileSigns(field_.tree(), result_->tree());
  if (request_.ofMovedSurface) meeting_.emplace(surface_, *polishers_, request_, *result_);

  // === Range of the slabs
  for (auto leaf = field_.tree().cbeginLeaf(); leaf; ++leaf)
    inputLeaves_[NearestPoints::slabOf(leaf->origin())].push_back(leaf->origin());
  for (std::size_t i = 0; i < search_->blockCount(); ++i)
    pointBlocks_[NearestPoints::slabOf(search_->origin(i))].push_back(i);
  CoordBBox surface = search_->bounds();
  for (const Vec3d& feature : search_->features()) surface.expand(Coord::floor(feature));
  // Grid points inside lie in nodes or tiles of the root; the background is outside. An inward
  // offset by far more than the size of the solid would visit many empty slabs.
  CoordBBox nodes = surface;
  nodes.expand(field_.tree().root().getMinIndex());
  nodes.expand(field_.tree().root().getMaxIndex());
  const auto beyond = [](double reach) { return slabsWithin(reach + 2) + 1; };
  const int low = NearestPoints::slabOf(surface.min()), high = NearestPoints::slabOf(surface.max());
  int first =
      std::min(low - beyond(reach_.outside),
               std::max(low - beyond(reach_.inside), NearestPoints::slabOf(nodes.min()) - 1));
  last_ = std::max(high + beyond(reach_.outside),
                   std::min(high + beyond(reach_.inside), NearestPoints::slabOf(nodes.max()) + 1));
  if (!inputLeaves_.empty()) {
    first = std::min(first, inputLeaves_.begin()->first);
    last_ = std::max(last_, inputLeaves_.rbegin()->first);
  }
  found_ = made_ = searched_ = resolved_ = first - 1;

  // === Steps
  nearest_->beginAt(first, last_);
  if (request_.region) findAllPoints();
  const double steps = last_ - first + 1.0, end = meeting_ ? 0.8 : 1;
  for (int g = first >> 1; nearest_->lastFinal() < last_; ++g) {
    if (!request_.region)
      while (found_ < 2 * g + 1) findPoints(++found_);
    nearest_->advance(g);
    follow(nearest_->lastFinal());
    release();
    report(request_.progress,
           0.1 + (end - 0.1) * std::clamp((nearest_->lastFinal() - first + 1) / steps, 0.0, 1.0));
  }
  if (meeting_) {
    releaseSurface();
    meeting_->finish();
  }
  openvdb::tools::pruneTiles(result_->tree());
  result_->setName(field_.getName());
  result_->setGridClass(openvdb::GRID_LEVEL_SET);
  report(request_.progress, 1);
  return result_;
}

}  // namespace

FloatGrid::Ptr distanceTransform(const FloatGrid& field, const DistanceRequest& request) {
  return DistanceSweep(field, nullptr, request).run();
}

FloatGrid::Ptr distanceTransform(FloatGrid::Ptr&& field, const DistanceRequest& request) {
  const FloatGrid::Ptr own = std::move(field);
  const bool isShared = own.use_count() > 1 || own->treePtr().use_count() > 2;
  return DistanceSweep(*own, isShared ? nullptr : &own->tree(), request).run();
}

}  // namespace levelset::eikonal
