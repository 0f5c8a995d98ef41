#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <unordered_map>
#include <vector>

#include "levelset/eikonal/point_sources.h"
#include "levelset/eikonal/upwind.h"
#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Arrival times at the 8³ grid points of a leaf block.
/// Times are divided by the time that the front takes for a voxel at a typical speed. At that speed
/// they are distances in voxels. They are 0 where the front starts and positive on both sides of
/// it. A block has no copies of the times in its neighbours, but pointers to these blocks. The
/// solver reads a newly accepted time from the neighbouring blocks at once.
struct ArrivalBlock {
  using Mask = openvdb::util::NodeMask<3>;
  static constexpr openvdb::Index kSize = 512;

  openvdb::Coord origin;
  std::uint32_t number = 0;
  std::array<float, kSize> time;
  /// Slowness divided by the typical slowness; kFar where the front cannot pass; null: 1
  /// everywhere.
  std::unique_ptr<std::array<float, kSize>> slowness;
  /// Blocks at −x, +x, −y, +y, −z, +z; null where there is no block.
  std::array<ArrivalBlock*, 6> neighbours{};
  Mask inside;      ///< grid points on the negative side of the start surface
  Mask known;       ///< grid points with a start time or an accepted time
  Mask firstOrder;  ///< grid points that fell back to first order on one axis or more

  [[nodiscard]] double slownessAt(openvdb::Index n) const {
    return slowness ? static_cast<double>((*slowness)[n]) : 1.0;
  }
  /// Returns the block that holds the neighbour of grid point `n` in direction d; null if that
  /// block does not exist. d = 2 · axis for the previous grid point along the axis, 2 · axis + 1
  /// for the next one. `to` receives the neighbour's offset in its block.
  [[nodiscard]] const ArrivalBlock* step(openvdb::Index n, int d, openvdb::Index& to) const {
    const int shift = 6 - 3 * (d >> 1);
    const openvdb::Index at = n >> shift & 7u;
    if (d & 1) {
      to = at == 7 ? n - (7u << shift) : n + (1u << shift);
      return at == 7 ? neighbours[static_cast<std::size_t>(d)] : this;
    }
    to = at == 0 ? n + (7u << shift) : n - (1u << shift);
    return at == 0 ? neighbours[static_cast<std::size_t>(d)] : this;
  }
};

/// Grid point where the front starts, with its time, scaled as in ArrivalBlock.
struct StartTime {
  openvdb::Coord gridPoint;
  float time = 0;
};

/// Blocks that a front has reached. They are added one by one and numbered in that order.
class ArrivalBlocks {
 public:
  struct Settings {
    double until = 0;  ///< latest time to compute, scaled as in ArrivalBlock
    /// Slowness at a grid point divided by the typical slowness; empty: 1 everywhere.
    std::function<double(const openvdb::Coord&)> slowness = {};
    /// Level set whose negative values mark the inside; null: no grid point is inside.
    const openvdb::FloatTree* side = nullptr;
    std::shared_ptr<const PointSources> sources = {};  ///< point sources; null: starts at a surface
    std::size_t maxMemory = kNoMemoryLimit;
    Progress progress = {};
  };
  explicit ArrivalBlocks(Settings settings);

  /// Creates the blocks that hold the grid points of `times` and stores their start times.
  /// @throws InvalidInput when the speed is positive at none of the grid points
  void start(const std::vector<StartTime>& times);
  /// Returns the block at `origin` and creates it if needed. A new block has no slowness before the
  /// next call of loadSlowness().
  ArrivalBlock& touch(const openvdb::Coord& origin);
  /// Evaluates the slowness of the blocks created since the last call, in parallel.
  void loadSlowness();

  [[nodiscard]] const Settings& settings() const { return settings_; }
  [[nodiscard]] StraightTime straightTime(const ArrivalBlock& block, openvdb::Index n) const {
    if (!settings_.sources) return {};
    return settings_.sources->straightTime(
        block.origin + openvdb::FloatTree::LeafNodeType::offsetToLocalCoord(n),
        block.slownessAt(n));
  }
  [[nodiscard]] std::deque<ArrivalBlock>& blocks() { return blocks_; }
  [[nodiscard]] const std::deque<ArrivalBlock>& blocks() const { return blocks_; }
  [[nodiscard]] ArrivalBlock& block(std::uint32_t number) { return blocks_[number]; }
  [[nodiscard]] bool holds(const openvdb::Coord& origin) const { return index_.count(origin) > 0; }

 private:
  void checkMemoryFor(const openvdb::Coord& origin) const;

  Settings settings_;
  std::unique_ptr<openvdb::FloatGrid::ConstAccessor> side_;
  std::deque<ArrivalBlock> blocks_;
  std::unordered_map<openvdb::Coord, ArrivalBlock*, std::hash<openvdb::Coord>> index_;
  std::size_t loaded_ = 0;  ///< number of blocks with loaded slowness
  double limit_ = 0;        ///< memory limit of the blocks, bytes
};

}  // namespace levelset::eikonal
