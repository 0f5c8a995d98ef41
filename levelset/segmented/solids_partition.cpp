#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <tuple>

#include "levelset/progress_gate.h"
#include "levelset/segmented/local/block_surroundings.h"
#include "levelset/segmented/solids_partition_vdb.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::FloatTree;
using openvdb::Int32Tree;

/// Number of an operand, from 1. 0 is the void. A higher rank wins.
using Rank = std::uint16_t;
constexpr std::uint32_t kVoxels = SegmentedData::kVoxels;

constexpr float kTie = 1e-4f;  // voxels: difference of distances that are equal but for rounding

/// Leaf of an operand.
struct RankedLeaf {
  Coord block;
  Rank rank;
  const float* values;
};

/// Block in which the surfaces of solids are visible.
struct SolidBlock {
  Coord block;
  std::size_t first, last;  ///< leaves of the operands, by rank, that no solid covers
  Rank top;                 ///< rank of the solid that fills the block below them
  std::vector<Rank> ranks;  ///< ranks of the voxels; a single one if they are equal
  std::vector<Rank> palette;
};

/// Partition of several solids on one grid. The solid of the highest rank that contains a point
/// owns it, so the interface between two regions lies on the surface of the solid with the higher
/// rank.
class SolidsPartition {
 public:
  SolidsPartition(const std::vector<NarrowBand>& solids, std::vector<RegionLabel> labels,
                  double halfWidth, double gapVoxels)
      : solids_(solids),
        labels_(std::move(labels)),
        voxelSize_(vdb(solids.front()).voxelSize()[0]),
        far_(vdb(solids.front()).background()),
        background_(std::min(backgroundOf(halfWidth, voxelSize_), far_)),
        gap_(static_cast<float>(gapVoxels * voxelSize_)) {}

  /// Finds the blocks and the owners of their voxels.
  void classify(const Progress& progress) {
    gatherLeaves();
    fillTiles();
    gatherBlocks();
    ProgressGate gate(progress, blocks_.size());
    tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) {
      classifyBlock(blocks_[b]);
      gate.advance(1);
    });
    keepMixedBlocks();
  }

  /// Computes distances and packs the blocks.
  [[nodiscard]] std::vector<PackedBlock> evaluate(const Progress& progress) {
    std::vector<PackedBlock> packed(blocks_.size());
    lost_.assign(blocks_.size(), {});
    ProgressGate gate(progress, blocks_.size());
    tbb::parallel_for(std::size_t{0}, blocks_.size(), [&](std::size_t b) {
      packed[b] = evaluateBlock(b);
      gate.advance(1);
    });
    return packed;
  }

  /// Tiles with labels in place of ranks.
  [[nodiscard]] Int32Tree::Ptr takeTiles() {
    for (auto it = tiles_->beginValueAll(); it; ++it)
      if (*it < 0) it.setValue(SegmentedData::tile(labelOf(rankOfTile(*it))));
    return std::move(tiles_);
  }
  [[nodiscard]] std::vector<LostPlace> lostPlaces() const {
    std::vector<LostPlace> all;
    for (const std::vector<LostPlace>& block : lost_)
      all.insert(all.end(), block.begin(), block.end());
    return all;
  }

 private:
  [[nodiscard]] static Rank rankOfTile(std::int32_t value) {
    return SegmentedData::labelOfTile(value);
  }
  [[nodiscard]] RegionLabel labelOf(Rank rank) const {
    return rank == 0 ? kVoid : labels_[rank - 1u];
  }
  [[nodiscard]] const FloatTree& tree(Rank rank) const { return vdb(solids_[rank - 1u]).tree(); }

  [[nodiscard]] static Coord originOf(const SolidBlock& block) {
    return {block.block[0] << 3, block.block[1] << 3, block.block[2] << 3};
  }

  void gatherLeaves() {
    for (std::size_t i = 0; i < solids_.size(); ++i)
      for (auto leaf = vdb(solids_[i]).tree().cbeginLeaf(); leaf; ++leaf)
        leaves_.push_back({SegmentedData::blockCoord(leaf->origin()), static_cast<Rank>(i + 1),
                           leaf->buffer().data()});
    tbb::parallel_sort(leaves_.begin(), leaves_.end(), [](const auto& a, const auto& b) {
      return std::tie(a.block, a.rank) < std::tie(b.block, b.rank);
    });
  }

  /// Marks the blocks that solids fill, each with the highest rank.
  void fillTiles() {
    for (std::size_t i = 0; i < solids_.size(); ++i) {
      auto it = vdb(solids_[i]).tree().cbeginValueAll();
      it.setMaxDepth(FloatTree::DEPTH - 2);  // tiles only
      for (; it; ++it) {
        if (*it >= 0) continue;
        const openvdb::CoordBBox box = it.getBoundingBox();
        tiles_->sparseFill(
            {SegmentedData::blockCoord(box.min()), SegmentedData::blockCoord(box.max())},
            SegmentedData::tile(static_cast<Rank>(i + 1)), false);
      }
    }
  }

  void gatherBlocks() {
    openvdb::tree::ValueAccessor<const Int32Tree> tiles(*tiles_);
    for (std::size_t first = 0, last = 0; first < leaves_.size(); first = last) {
      const Coord block = leaves_[first].block;
      while (last < leaves_.size() && leaves_[last].block == block) ++last;
      const Rank top = rankOfTile(tiles.getValue(block));
      std::size_t visible = first;
      while (visible < last && leaves_[visible].rank < top) ++visible;
      if (visible < last) blocks_.push_back({block, visible, last, top, {}, {}});
    }
  }

  void classifyBlock(SolidBlock& block) const {
    std::array<Rank, kVoxels> ranks;
    ranks.fill(block.top);
    // Distance to the surfaces that are not covered, as in distancesOf().
    std::array<float, kVoxels> distance;
    distance.fill(far_);
    for (std::size_t e = block.first; e < block.last; ++e) {
      const RankedLeaf& leaf = leaves_[e];
      for (std::uint32_t n = 0; n < kVoxels; ++n) {
        const float phi = leaf.values[n];
        ranks[n] = phi < 0 ? leaf.rank : ranks[n];
        distance[n] = phi < 0 ? -phi : std::min(distance[n], phi);
      }
    }
    if (block.top == 0 && block.last - block.first > 1) closeGaps(block, ranks);
    const bool isActive =
        std::any_of(distance.begin(), distance.end(), [&](float d) { return d < background_; });
    Rank last = ranks[0];
    block.palette.push_back(last);
    for (const Rank rank : ranks) {
      if (rank == last) continue;
      last = rank;
      if (std::find(block.palette.begin(), block.palette.end(), rank) == block.palette.end())
        block.palette.push_back(rank);
    }
    if (block.palette.size() > 1)
      block.ranks.assign(ranks.begin(), ranks.end());
    else
      block.ranks.assign(1, ranks[0]);
    if (!isActive && block.ranks.size() == 1) block.palette.clear();  // becomes a tile
  }

  /// Gives grid points of the void between touching faces to the nearer solid. Where the faces lie
  /// on grid points, both distances are zero there, and the void would have films without
  /// thickness.
  void closeGaps(const SolidBlock& block, std::array<Rank, kVoxels>& ranks) const {
    for (std::uint32_t n = 0; n < kVoxels; ++n) {
      if (ranks[n] != 0) continue;
      float least = far_, second = far_;
      Rank nearest = 0;
      for (std::size_t e = block.first; e < block.last; ++e) {
        const float phi = leaves_[e].values[n];
        if (phi <= least) {
          second = least;
          least = phi;
          nearest = leaves_[e].rank;
        } else {
          second = std::min(second, phi);
        }
      }
      if (least + second <= gap_) ranks[n] = nearest;
    }
  }

  void keepMixedBlocks() {
    openvdb::tree::ValueAccessor<Int32Tree> tiles(*tiles_);
    std::size_t kept = 0;
    for (SolidBlock& block : blocks_) {
      if (block.palette.empty()) {
        tiles.setValueOff(block.block, SegmentedData::tile(block.ranks[0]));
        continue;
      }
      tiles.setValueOff(block.block, static_cast<std::int32_t>(kept));
      if (&blocks_[kept] != &block) blocks_[kept] = std::move(block);
      ++kept;
    }
    blocks_.resize(kept);
  }

  /// Numbers or tiles of the 27 blocks around a block.
  [[nodiscard]] std::array<std::int32_t, 27> valuesAround(const Coord& block) const {
    openvdb::tree::ValueAccessor<const Int32Tree> tiles(*tiles_);
    std::array<std::int32_t, 27> values{};
    std::size_t n = 0;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z) values[n++] = tiles.getValue(block.offsetBy(x, y, z));
    return values;
  }

  void fillSurroundings(const std::array<std::int32_t, 27>& values,
                        BlockSurroundings& around) const {
    around.fill([&](int i, int j, int k, int x, int y, Rank* row) {
      const std::int32_t value = values[static_cast<std::size_t>(i * 9 + j * 3 + k + 13)];
      if (value < 0) {
        std::fill_n(row, 8, rankOfTile(value));
        return;
      }
      const std::vector<Rank>& ranks = blocks_[static_cast<std::size_t>(value)].ranks;
      if (ranks.size() == 1)
        std::fill_n(row, 8, ranks[0]);
      else
        std::copy_n(ranks.begin() + (x * 64 + y * 8), 8, row);
    });
  }

  [[nodiscard]] const float* valuesOf(const SolidBlock& block, Rank rank) const {
    for (std::size_t e = block.first; e < block.last; ++e)
      if (leaves_[e].rank == rank) return leaves_[e].values;
    return nullptr;
  }
  /// Distance of a voxel of region `own` from its interface with region `other`. It lies on the
  /// surface of the one with the higher rank. Where the other one is below and farther away, it
  /// only touches the own solid there, at the distance of its own surface.
  [[nodiscard]] float distanceTo(const SolidBlock& block, std::uint32_t voxel, Rank own,
                                 Rank other) const {
    const auto phi = [&](Rank rank, float beyond) {
      const float* values = valuesOf(block, rank);
      return values ? values[voxel] : rank == block.top ? -far_ : beyond;
    };
    if (other > own) return std::max(0.0f, phi(other, far_));
    const float depth = std::max(0.0f, -phi(own, -far_));
    return other == 0 ? depth : std::max(depth, phi(other, depth));
  }

  /// Ranks in the 27 blocks around a block; at most three of them.
  [[nodiscard]] std::vector<Rank> ranksAround(const std::array<std::int32_t, 27>& values) const {
    std::vector<Rank> ranks;
    const auto add = [&](Rank rank) {
      if (std::find(ranks.begin(), ranks.end(), rank) == ranks.end()) ranks.push_back(rank);
    };
    for (const std::int32_t value : values) {
      if (value < 0)
        add(rankOfTile(value));
      else
        for (const Rank rank : blocks_[static_cast<std::size_t>(value)].palette) add(rank);
      if (ranks.size() > 2) break;
    }
    std::sort(ranks.begin(), ranks.end());
    return ranks;
  }

  [[nodiscard]] PackedBlock evaluateBlock(std::size_t number) {
    const SolidBlock& block = blocks_[number];
    const bool isOfOne = block.last - block.first == 1;
    const std::array<std::int32_t, 27> blocksAround = valuesAround(block.block);
    std::vector<Rank> palette = ranksAround(blocksAround);
    BlockSurroundings around;
    if (palette.size() > 2 || !isOfOne) {
      fillSurroundings(blocksAround, around);
      palette = around.palette();
    }
    if (!isOfOne && palette.size() > 1) findLost(block, around, lost_[number]);
    if (palette.size() == 2) {
      // No junction is near, and the neighbour is the other region. Only where a gap was closed, a
      // voxel may not have the owner that the sign tells.
      const Rank low = palette[0], high = palette[1];
      if (const float* phi = valuesOf(block, high); phi && hasSigns(block, high, phi))
        return packTwoRegions(originOf(block), phi, labelOf(high), labelOf(low), background_);
    }
    SegmentedBlockValues values;
    values.origin = originOf(block);
    const auto rankAt = [&](std::uint32_t n) {
      return block.ranks[block.ranks.size() == 1 ? 0 : n];
    };
    for (std::uint32_t n = 0; n < kVoxels; ++n) values.labels[n] = labelOf(rankAt(n));
    if (palette.size() == 1) {
      for (std::uint32_t n = 0; n < kVoxels; ++n) setNearest(block, n, rankAt(n), values);
    } else {
      if (isOfOne && palette.size() == 2) fillSurroundings(blocksAround, around);
      around.findNeighbours();
      Others others;
      for (std::uint32_t n = 0; n < kVoxels; ++n)
        evaluateVoxel(block, n, rankAt(n), around, others, values);
    }
    return packBlock(values, background_);
  }

  /// Returns true when the sign of a solid's distance tells in all voxels if the solid owns them.
  static bool hasSigns(const SolidBlock& block, Rank rank, const float* phi) {
    int wrong = 0;  // without branches, so that the loops vectorise
    if (block.ranks.size() == 1) {
      const bool isOwner = block.ranks[0] == rank;
      for (std::uint32_t n = 0; n < kVoxels; ++n) wrong += isOwner != (phi[n] < 0);
    } else {
      const Rank* ranks = block.ranks.data();
      for (std::uint32_t n = 0; n < kVoxels; ++n) wrong += (ranks[n] == rank) != (phi[n] < 0);
    }
    return wrong == 0;
  }

  /// Regions up to two voxels away from a voxel, ascending, and the distances of the voxel from the
  /// interfaces with them.
  struct Others {
    std::vector<Rank> ranks;
    std::vector<float> distances;
    std::vector<Rank> adjacent;  ///< those up to one voxel away
    // Memory of neighbourAmong().
    std::vector<std::size_t> tied = {}, touching = {};

    [[nodiscard]] std::size_t nearest() const {
      return static_cast<std::size_t>(std::min_element(distances.begin(), distances.end()) -
                                      distances.begin());
    }
  };

  /// Sets the distances of a voxel in a block near several regions.
  /// @param others  memory to work in
  void evaluateVoxel(const SolidBlock& block, std::uint32_t n, Rank own,
                     const BlockSurroundings& around, Others& others,
                     SegmentedBlockValues& values) const {
    setNearest(block, n, own, values);
    const BlockSurroundings::Near near = around.near(n, own);
    if (near.count == 0) return;
    if (near.count == 1) {
      if (!near.isAdjacent && values.distances[n] >= background_) return;
      values.neighbours[n] = labelOf(near.other);
      if (near.isAdjacent)
        values.distances[n] =
            std::min(distanceTo(block, n, own, near.other), std::nextafter(background_, 0.0f));
      return;
    }
    around.others(n, own, 2, others.ranks);
    if (others.ranks.empty()) return;
    around.others(n, own, 1, others.adjacent);
    if (others.adjacent.empty() && values.distances[n] >= background_) return;
    others.distances.clear();
    for (const Rank rank : others.ranks)
      others.distances.push_back(distanceTo(block, n, own, rank));
    const std::size_t chosen = neighbourAmong(block, n, own, others, around);
    values.neighbours[n] = labelOf(others.ranks[chosen]);
    if (others.adjacent.empty()) return;
    // Cells with several labels need a distance in all corners.
    const float largest = std::nextafter(background_, 0.0f);
    values.distances[n] = std::min(others.distances[chosen], largest);
    const std::size_t begin = values.extras.size();
    for (std::size_t i = 0; i < others.ranks.size(); ++i)
      if (i != chosen &&
          std::binary_search(others.adjacent.begin(), others.adjacent.end(), others.ranks[i]))
        values.extras.push_back({static_cast<std::uint16_t>(n), labelOf(others.ranks[i]),
                                 std::min(others.distances[i], background_)});
    std::sort(values.extras.begin() + static_cast<std::ptrdiff_t>(begin), values.extras.end(),
              [](const auto& a, const auto& b) { return a.label < b.label; });
  }

  /// Chooses the region across the nearest interface. Several regions may lie beyond the surface of
  /// the own solid; then the distances to them are equal. Of these, a solid whose own surface is
  /// that near touches the own solid there.
  /// @return index in `others`
  [[nodiscard]] std::size_t neighbourAmong(const SolidBlock& block, std::uint32_t n, Rank own,
                                           Others& others, const BlockSurroundings& around) const {
    const float tolerance = std::max(gap_, kTie * static_cast<float>(voxelSize_));
    const std::size_t nearest = others.nearest(), count = others.ranks.size();
    const float distance = others.distances[nearest];
    std::vector<std::size_t>&tied = others.tied, &touching = others.touching;
    tied.clear();
    touching.clear();
    for (std::size_t i = 0; i < count; ++i) {
      if (others.distances[i] > distance + tolerance) continue;
      tied.push_back(i);
      const float* values = valuesOf(block, others.ranks[i]);
      if (values && values[n] > distance - tolerance) touching.push_back(i);
    }
    const std::vector<std::size_t>& candidates = touching.empty() ? tied : touching;
    if (candidates.size() == 1) return candidates[0];
    const Rank beyond = rankBeyond(block, n, own, distance, around);
    for (const std::size_t i : candidates)
      if (others.ranks[i] == beyond) return i;
    // Takes the region of the nearest grid point.
    const Coord at = SegmentedData::localOf(n);
    int least = 13;
    std::size_t best = candidates[0];
    for (int x = -2; x <= 2; ++x)
      for (int y = -2; y <= 2; ++y)
        for (int z = -2; z <= 2; ++z) {
          const int squared = x * x + y * y + z * z;
          if (squared >= least) continue;
          const Rank rank = around.at(at[0] + x, at[1] + y, at[2] + z);
          for (const std::size_t i : candidates) {
            if (others.ranks[i] != rank) continue;
            least = squared;
            best = i;
          }
        }
    return best;
  }

  /// Rank of the grid point that lies beyond the point of the own solid's surface that is closest
  /// to a voxel. The own rank where the slope does not tell the direction.
  /// @param depth  distance of the voxel from that surface
  [[nodiscard]] Rank rankBeyond(const SolidBlock& block, std::uint32_t n, Rank own, float depth,
                                const BlockSurroundings& around) const {
    constexpr double kLeastSlope = 0.8, kBeyond = 0.75;
    const float* values = valuesOf(block, own);
    if (!values) return own;
    const Coord at = SegmentedData::localOf(n);
    const auto phi = [&](const Coord& p) {
      const bool isInBlock = ((p[0] | p[1] | p[2]) & ~7) == 0;
      return static_cast<double>(isInBlock ? values[SegmentedData::offsetOf(p)]
                                           : tree(own).getValue(originOf(block) + p));
    };
    Imath::V3d slope;
    for (int axis = 0; axis < 3; ++axis) {
      Coord low = at, high = at;
      low[axis] -= 1;
      high[axis] += 1;
      slope[axis] = (phi(high) - phi(low)) / (2 * voxelSize_);
    }
    const double length = slope.length();
    if (!(length > kLeastSlope)) return own;
    const Imath::V3d move = slope * ((static_cast<double>(depth) / voxelSize_ + kBeyond) / length);
    const auto coordinate = [&](int axis) {
      return std::clamp(at[axis] + static_cast<int>(std::lround(move[axis])),
                        -BlockSurroundings::kPad, 7 + BlockSurroundings::kPad);
    };
    return around.at(coordinate(0), coordinate(1), coordinate(2));
  }

  /// Sets distance and neighbour of a voxel among voxels of its own region.
  void setNearest(const SolidBlock& block, std::uint32_t n, Rank own,
                  SegmentedBlockValues& values) const {
    float distance = far_;
    Rank neighbour = 0;
    for (std::size_t e = block.last; e-- > block.first;) {
      const RankedLeaf& leaf = leaves_[e];
      if (leaf.rank < own) break;
      const float phi = leaf.rank == own ? -leaf.values[n] : leaf.values[n];
      if (phi >= distance) continue;
      distance = phi;
      neighbour = leaf.rank == own ? Rank{0} : leaf.rank;
    }
    values.distances[n] = std::max(0.0f, distance);
    values.neighbours[n] = labelOf(neighbour);
  }

  static constexpr std::array<std::uint32_t, 3> kStrides = {64, 8, 1};
  static constexpr int kSteps = 8;  // in which the edges of the grid are searched

  /// Finds parts between two neighbouring grid points that own neither of them.
  void findLost(const SolidBlock& block, const BlockSurroundings& around,
                std::vector<LostPlace>& places) const {
    const Coord origin = originOf(block);
    std::uint32_t n = 0;
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y) {
        const Rank* row = around.row(x, y);
        const std::array<const Rank*, 3> next = {around.row(x + 1, y), around.row(x, y + 1),
                                                 row + 1};
        for (int z = 0; z < 8; ++z, ++n)
          for (std::size_t axis = 0; axis < 3; ++axis) {
            const Rank a = row[z], b = next[axis][z];
            if (a != b && mayHoldPart(block, origin, n, static_cast<int>(axis)))
              findLostOnEdge(block, origin, n, static_cast<int>(axis), {a, b}, places);
          }
      }
  }

  /// Returns true when the outermost crossings of surfaces with an edge of the grid are so far
  /// apart that a part between them counts.
  [[nodiscard]] bool mayHoldPart(const SolidBlock& block, const Coord& origin, std::uint32_t n,
                                 int axis) const {
    float first = 1, last = 0;
    const Coord local = SegmentedData::localOf(n);
    for (std::size_t e = block.first; e < block.last; ++e) {
      const RankedLeaf& leaf = leaves_[e];
      const float u = leaf.values[n], v = nextValue(leaf, origin, local, n, axis);
      if ((u < 0) == (v < 0)) continue;
      first = std::min(first, u / (u - v));
      last = std::max(last, u / (u - v));
    }
    return last - first > 1.0f / kSteps;
  }
  /// Value of a leaf at the next grid point along an axis.
  [[nodiscard]] float nextValue(const RankedLeaf& leaf, const Coord& origin, const Coord& local,
                                std::uint32_t n, int axis) const {
    if (local[axis] < 7) return leaf.values[n + kStrides[static_cast<std::size_t>(axis)]];
    Coord next = origin + local;
    next[axis] += 1;
    return tree(leaf.rank).getValue(next);
  }

  void findLostOnEdge(const SolidBlock& block, const Coord& origin, std::uint32_t n, int axis,
                      const std::array<Rank, 2>& ends, std::vector<LostPlace>& places) const {
    const Coord local = SegmentedData::localOf(n);
    std::array<Rank, kSteps> owners;  // at t = i / kSteps
    owners.fill(block.top);
    std::array<float, kSteps> least, second;
    least.fill(far_);
    second.fill(far_);
    for (std::size_t e = block.first; e < block.last; ++e) {
      const RankedLeaf& leaf = leaves_[e];
      const float u = leaf.values[n], v = nextValue(leaf, origin, local, n, axis);
      for (std::size_t i = 1; i < kSteps; ++i) {
        const float phi = u + (v - u) * (static_cast<float>(i) / kSteps);
        if (phi < 0) owners[i] = leaf.rank;
        second[i] = std::min(second[i], std::max(least[i], phi));
        least[i] = std::min(least[i], phi);
      }
    }
    for (std::size_t i = 1; i < kSteps; ++i) {
      const Rank owner = owners[i];
      if (owner == ends[0] || owner == ends[1]) continue;
      if (owner == 0 && least[i] + second[i] <= 2 * gap_) continue;
      std::size_t end = i;
      while (end + 1 < kSteps && owners[end + 1] == owner) ++end;
      const std::size_t steps = end - i + 1;
      openvdb::Vec3d p = (origin + local).asVec3d();
      p[axis] += static_cast<double>(i + end) / (2.0 * kSteps);
      // Convex edges lose an eighth of a voxel by interpolation.
      if (steps > 1)
        places.push_back({labelOf(owner), static_cast<double>(steps) / kSteps, toImath(p)});
      i = end;
    }
  }

  const std::vector<NarrowBand>& solids_;
  std::vector<RegionLabel> labels_;
  double voxelSize_;
  float far_;         ///< background of the solids
  float background_;  ///< background of the field
  float gap_;         ///< world units
  std::vector<RankedLeaf> leaves_;
  std::vector<SolidBlock> blocks_;
  Int32Tree::Ptr tiles_ =
      std::make_shared<Int32Tree>(SegmentedData::tile(kVoid));  ///< ranks, or numbers of blocks
  std::vector<std::vector<LostPlace>> lost_;                    ///< by block
};

}  // namespace

PartitionOfSolids partitionSolids(const std::vector<NarrowBand>& solids,
                                  const std::vector<RegionLabel>& labels, double halfWidth,
                                  double gap, const Progress& progress) {
  SolidsPartition partition(solids, labels, halfWidth, gap);
  partition.classify(subProgress(progress, 0, 0.4));
  PartitionOfSolids result;
  result.blocks = partition.evaluate(subProgress(progress, 0.4, 1));
  result.tiles = partition.takeTiles();
  result.lost = partition.lostPlaces();
  return result;
}

}  // namespace levelset
