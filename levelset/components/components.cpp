#include "levelset/components/components.h"

#include <fmt/core.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tree/LeafManager.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <vector>

#include "levelset/components/regions.h"
#include "levelset/distance/redistance.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/measure.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Int32Tree;
using FloatLeaf = FloatTree::LeafNodeType;
using LabelLeaf = Int32Tree::LeafNodeType;
using BlockSet = std::set<Coord>;

/// Largest difference, in voxels, between the distances of a grid point before and after the flip
/// that count as equal.
constexpr float kSameDistance = 0.02f;
/// Smallest magnitude, in voxels, of a value whose sign was flipped. It keeps the sign of a value
/// that was zero.
constexpr float kLeastDistance = 1e-3f;

/// Returns a value of the given magnitude on the side of `value`. Zeros of both signs are outside.
float onSideOf(float value, float magnitude) {
  return value < 0 ? -magnitude : magnitude;
}

/// Flips connected regions of grid points from inside to outside or from outside to inside. The
/// surfaces between a flipped region and its neighbours vanish. Grid points whose nearest surface
/// remains keep their bits.
class RegionFlip {
 public:
  RegionFlip(const NarrowBand& solid, const RegionMap& map, std::vector<bool> flipped,
             const Progress& progress)
      : solid_(solid), map_(map), flipped_(std::move(flipped)), progress_(progress) {
    bandBlocks_ = static_cast<int>(std::ceil((solid.halfWidth() + 1) / 8));
  }

  [[nodiscard]] NarrowBand run() {
    collectBlocks();
    NarrowBand result = solid_;
    FloatGrid& grid = editVdb(result);
    flipTiles(grid);
    openvdb::tree::LeafManager<FloatTree> leaves(grid.tree());
    leaves.foreach ([this](FloatLeaf& leaf, std::size_t) { flipLeaf(leaf); });
    if (!both_.empty()) renew(result);
    openvdb::tools::prune(editVdb(result).tree());
    return result;
  }

 private:
  [[nodiscard]] bool isFlipped(std::int32_t region) const {
    return flipped_[static_cast<std::size_t>(region)];
  }

  /// Collects in `vanishing_` the origins of the blocks within the half width of a vanishing
  /// surface, and in `both_` those of them that are also within the half width of a remaining
  /// surface.
  void collectBlocks() {
    BlockSet vanishing, remaining;
    map_.forEachSurfaceBlock([&](const Coord& origin, std::uint32_t component) {
      const RegionSurface& s = map_.surfaces()[component];
      const bool stays = isFlipped(static_cast<std::int32_t>(s.inside)) ==
                         isFlipped(static_cast<std::int32_t>(s.outside));
      (stays ? remaining : vanishing).insert(origin);
    });
    vanishing_ = dilated(vanishing);
    for (const Coord& origin : dilated(remaining)) {
      if (vanishing_.count(origin)) both_.insert(origin);
    }
  }

  [[nodiscard]] BlockSet dilated(const BlockSet& blocks) const {
    BlockSet result;
    for (const Coord& origin : blocks)
      for (int x = -bandBlocks_; x <= bandBlocks_; ++x)
        for (int y = -bandBlocks_; y <= bandBlocks_; ++y)
          for (int z = -bandBlocks_; z <= bandBlocks_; ++z)
            result.insert(origin.offsetBy(8 * x, 8 * y, 8 * z));
    return result;
  }

  void flipTiles(FloatGrid& grid) const {
    openvdb::tree::ValueAccessor<const Int32Tree> labels(map_.labels());
    auto tile = grid.tree().beginValueAll();
    tile.setMaxDepth(FloatTree::DEPTH - 2);
    for (; tile; ++tile) {
      if (isFlipped(labels.getValue(tile.getBoundingBox().min()))) tile.setValue(-*tile);
    }
  }

  /// Corrects the signs of a leaf. If only vanishing surfaces are near, also sets the values to ±
  /// background and deactivates them. If a remaining surface is near too (blocks in `both_`),
  /// renew() corrects the distances.
  void flipLeaf(FloatLeaf& leaf) const {
    const LabelLeaf& labels = *map_.labels().probeConstLeaf(leaf.origin());
    const bool nearVanishing = vanishing_.count(leaf.origin()) > 0;
    const bool nearBoth = both_.count(leaf.origin()) > 0;
    const float background = vdb(solid_).background();
    const float least = kLeastDistance * static_cast<float>(solid_.voxelSize());
    float* values = leaf.buffer().data();
    for (openvdb::Index i = 0; i < FloatLeaf::SIZE; ++i) {
      const bool flips = isFlipped(labels.getValue(i));
      if (!flips && !nearVanishing) continue;
      const float sign = (values[i] < 0) != flips ? -1.f : 1.f;
      if (nearBoth) {
        if (flips) values[i] = sign * std::max(std::abs(values[i]), least);
      } else {
        values[i] = sign * background;
        leaf.setValueOff(i);
      }
    }
  }

  /// Returns a copy of the band in which grid points beside a vanished surface have a distance of
  /// at least one voxel. With smaller distances on both sides, an interpolant could cross zero
  /// there.
  [[nodiscard]] NarrowBand smoothed(const NarrowBand& flippedSolid) const {
    NarrowBand result = flippedSolid;
    FloatGrid& grid = editVdb(result);
    auto before = vdb(solid_).getConstAccessor(), after = vdb(flippedSolid).getConstAccessor();
    const float voxel = static_cast<float>(solid_.voxelSize());
    for (const Coord& origin : both_) {
      FloatLeaf* leaf = grid.tree().probeLeaf(origin);
      if (!leaf) continue;
      for (openvdb::Index i = 0; i < FloatLeaf::SIZE; ++i) {
        const Coord c = leaf->offsetToGlobalCoord(i);
        const float own = leaf->getValue(i);
        if (std::abs(own) < voxel && isBesideSurface(before, c, before.getValue(c)) &&
            !isBesideSurface(after, c, own)) {
          leaf->setValueOnly(i, onSideOf(own, voxel));
        }
      }
    }
    return result;
  }

  /// Returns the world box of the blocks near a vanishing and a remaining surface (`both_`),
  /// extended by more than the half width, so that it contains all surfaces near them.
  [[nodiscard]] Imath::Box3d worldBoxOfBoth() const {
    openvdb::BBoxd box;
    for (const Coord& origin : both_) {
      box.expand(openvdb::BBoxd(origin.asVec3d(), (origin + Coord(7)).asVec3d()));
    }
    box.expand(8.0 * (bandBlocks_ + 1));
    const openvdb::BBoxd world = vdb(solid_).transform().indexToWorld(box);
    return {toImath(world.min()), toImath(world.max())};
  }

  /// Recomputes the distances in the blocks near both a vanished and a remaining surface (`both_`).
  /// Grid points whose nearest surface has vanished get their distance from a redistanced copy.
  void renew(NarrowBand& result) const {
    // The copy is one voxel wider than the result, so that a distance just below the background of
    // the result is not clamped.
    const NarrowBand fresh =
        redistance(smoothed(result), {.halfWidth = solid_.halfWidth() + 1,
                                      .region = worldBoxOfBoth(),
                                      .progress = subProgress(progress_, 0.2, 0.9)});
    const NarrowBand before = result;
    FloatGrid& grid = editVdb(result);
    auto old = vdb(before).getConstAccessor();
    auto out = grid.getAccessor();
    auto in = vdb(fresh).getConstAccessor();
    openvdb::tree::ValueAccessor<const Int32Tree> labels(map_.labels());
    for (const Coord& origin : both_) {
      if (!old.probeConstLeaf(origin) && !in.probeConstLeaf(origin)) continue;
      FloatLeaf& leaf = *out.touchLeaf(origin);
      for (openvdb::Index i = 0; i < FloatLeaf::SIZE; ++i) {
        const Coord c = leaf.offsetToGlobalCoord(i);
        const float distance = std::abs(in.getValue(c));
        if (!isFlipped(labels.getValue(c)) && isRight(leaf, i, distance, old)) continue;
        const bool inBand = distance < grid.background();
        leaf.setValueOnly(i, onSideOf(leaf.getValue(i), inBand ? distance : grid.background()));
        leaf.setActiveState(i, inBand);
      }
    }
  }

  /// Returns true if a value is still correct after surfaces have vanished. An inactive value had
  /// no surface within the half width. An active value is correct if `distance`, recomputed from
  /// the remaining surfaces, is not larger. A value beside a remaining surface always counts as
  /// correct.
  [[nodiscard]] bool isRight(const FloatLeaf& leaf, openvdb::Index i, float distance,
                             FloatGrid::ConstAccessor& signs) const {
    if (!leaf.isValueOn(i)) return true;
    const float own = leaf.getValue(i);
    return distance <= std::abs(own) + kSameDistance * static_cast<float>(solid_.voxelSize()) ||
           isBesideSurface(signs, leaf.offsetToGlobalCoord(i), own);
  }

  /// Returns true if a grid point has a neighbour of the opposite sign. The value of such a grid
  /// point defines the zero set and must not change.
  static bool isBesideSurface(FloatGrid::ConstAccessor& values, const Coord& c, float own) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int step = -1; step <= 1; step += 2) {
        Coord beside = c;
        beside[axis] += step;
        if ((values.getValue(beside) < 0) != (own < 0)) return true;
      }
    }
    return false;
  }

  const NarrowBand& solid_;
  const RegionMap& map_;
  std::vector<bool> flipped_;
  const Progress& progress_;
  int bandBlocks_ = 1;
  BlockSet vanishing_, both_;
};

NarrowBand flip(const NarrowBand& solid, const RegionMap& map, std::vector<bool> flipped,
                const Progress& progress) {
  if (std::find(flipped.begin(), flipped.end(), true) == flipped.end()) return solid;
  return RegionFlip(solid, map, std::move(flipped), progress).run();
}

}  // namespace

Topology topology(const NarrowBand& solid) {
  const Measurement m = measure(solid);
  return {m.components, m.surfaces, m.cavities};
}

NarrowBand keepLargest(const NarrowBand& solid, std::size_t count, const Progress& progress) {
  if (!count) throw UsageError("--largest is 0; keep at least one solid");
  requireSolid(solid);
  if (solid.isEmpty()) {
    throw InvalidInput(
        "the level set is empty, so there is no solid to keep; check the actions "
        "before it");
  }
  const RegionMap map(vdb(solid), subProgress(progress, 0, 0.5));
  const std::vector<Region>& regions = map.regions();
  std::vector<std::size_t> solids;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (regions[i].inside) solids.push_back(i);
  }
  // Volumes of equal solids may differ in the last bits, so compare them in single precision.
  const auto volume = [&](std::size_t i) { return static_cast<float>(regions[i].volume); };
  std::stable_sort(solids.begin(), solids.end(),
                   [&](std::size_t a, std::size_t b) { return volume(a) > volume(b); });
  std::vector<bool> flipped(regions.size(), false);
  for (std::size_t i = count; i < solids.size(); ++i) flipped[solids[i]] = true;
  NarrowBand result = flip(solid, map, std::move(flipped), subProgress(progress, 0.5, 1));
  report(progress, 1);
  return result;
}

SliversDropped dropSlivers(const NarrowBand& solid, const NarrowBand& cutter,
                           const Progress& progress) {
  // Depth that a sliver does not reach, and largest distance of its grid points from the surface of
  // the cutter, voxels.
  constexpr float kDepth = 0.5, kNear = 1;
  const RegionMap map(vdb(solid), subProgress(progress, 0, 0.5));
  const std::vector<Region>& regions = map.regions();
  const auto voxel = static_cast<float>(solid.voxelSize());
  std::vector<bool> isSliver(regions.size());
  for (std::size_t i = 0; i < regions.size(); ++i) isSliver[i] = regions[i].inside;
  const FloatTree& tree = vdb(solid).tree();
  openvdb::tree::ValueAccessor<const Int32Tree> labels(map.labels());
  auto tile = tree.cbeginValueAll();
  tile.setMaxDepth(FloatTree::DEPTH - 2);
  for (; tile; ++tile)
    if (*tile < 0)
      isSliver[static_cast<std::size_t>(labels.getValue(tile.getBoundingBox().min()))] = false;
  std::vector<Coord> shallow;
  for (auto leaf = tree.cbeginLeaf(); leaf; ++leaf) {
    const LabelLeaf& own = *map.labels().probeConstLeaf(leaf->origin());
    for (openvdb::Index i = 0; i < FloatLeaf::SIZE; ++i) {
      const float value = leaf->getValue(i);
      if (!(value < 0)) continue;
      if (value < -kDepth * voxel)
        isSliver[static_cast<std::size_t>(own.getValue(i))] = false;
      else
        shallow.push_back(leaf->offsetToGlobalCoord(i));
    }
  }
  const BandSampler sampler(cutter);
  for (const Coord& c : shallow) {
    const auto region = static_cast<std::size_t>(labels.getValue(c));
    if (!isSliver[region]) continue;
    const double distance = sampler.value(toImath(vdb(solid).indexToWorld(c)));
    isSliver[region] = std::abs(distance) < kNear * voxel;
  }
  const auto count = static_cast<std::size_t>(std::count(isSliver.begin(), isSliver.end(), true));
  const auto solids = std::count_if(regions.begin(), regions.end(),
                                    [](const Region& region) { return region.inside; });
  if (count == 0 || count == static_cast<std::size_t>(solids)) return {solid, 0};
  return {flip(solid, map, std::move(isSliver), subProgress(progress, 0.5, 1)), count};
}

NarrowBand fillCavities(const NarrowBand& solid, double maxVolume, const Progress& progress) {
  if (!(maxVolume >= 0)) {
    throw UsageError(fmt::format(
        "the largest volume to fill is {}; give a number that is not negative", maxVolume));
  }
  requireSolid(solid);
  if (solid.isEmpty()) return solid;
  const RegionMap map(vdb(solid), subProgress(progress, 0, 0.5));
  const std::vector<Region>& regions = map.regions();
  const double limit = maxVolume / std::pow(solid.voxelSize(), 3);
  std::vector<bool> flipped(regions.size(), false);
  for (std::size_t i = 0; i < regions.size(); ++i) {
    flipped[i] = i != RegionMap::kInfinite && !regions[i].inside && regions[i].volume <= limit;
  }
  NarrowBand result = flip(solid, map, std::move(flipped), subProgress(progress, 0.5, 1));
  report(progress, 1);
  return result;
}

}  // namespace levelset
