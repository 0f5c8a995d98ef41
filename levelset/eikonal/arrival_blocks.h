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
/// they are distances in voxels. They count from the front's start and are positive on both sides.
/// Not a padded copy: accepted times must be visible in neighbouring blocks at once, so a block has
/// links to its neighbours.
struct ArrivalBlock {
  using Mask = openvdb::util::NodeMask<3>;
  static constexpr openvdb::Index kSize = 512;

  openvdb::Coord origin;
  std::uint32_t number = 0;
  std::array<float, kSize> time;
  /// Slowness relative to the typical one; kFar where the front cannot pass; empty: 1 everywhere.
  std::unique_ptr<std::array<float, kSize>> slowness;
  std::array<ArrivalBlock*, 6> neighbours{};  ///< −x, +x, −y, +y, −z, +z; null where there is none
  Mask inside;                                ///< on the negative side of the front's start
  Mask known;                                 ///< start times and accepted times
  Mask firstOrder;  ///< fell back from second to first order on one axis or more

  [[nodiscard]] double slownessAt(openvdb::Index n) const {
    return slowness ? static_cast<double>((*slowness)[n]) : 1.0;
  }
  /// Returns the block of a grid point's neighbour in direction d = axis · 2 + (step > 0), null if
  /// there is none. `to` is the neighbour's offset in that block.
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

/// Grid point with a known time at the start.
struct StartTime {
  openvdb::Coord gridPoint;
  float time = 0;
};

/// Blocks that a front has reached. They are added one by one and numbered in that order.
class ArrivalBlocks {
 public:
  struct Settings {
    double until = 0;                                            ///< latest time to keep
    std::function<double(const openvdb::Coord&)> slowness = {};  ///< empty: 1
    /// Negative values mark the inside; null: no grid point is inside.
    const openvdb::FloatTree* side = nullptr;
    std::shared_ptr<const PointSources> sources = {};  ///< set where the front starts at points
    std::size_t maxMemory = kNoMemoryLimit;
    Progress progress = {};
  };
  explicit ArrivalBlocks(Settings settings);

  /// Creates the blocks of the start and sets their times.
  /// @throws InvalidInput when the front cannot pass at any of the grid points
  void start(const std::vector<StartTime>& times);
  /// Returns the block at `origin` and creates it if needed; loadSlowness() must then fill its
  /// slowness.
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
  std::size_t loaded_ = 0;  ///< blocks whose slowness is known
  double limit_ = 0;        ///< bytes
};

}  // namespace levelset::eikonal
