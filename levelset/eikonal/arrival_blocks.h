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

/// Times at the 8³ grid points of a leaf block. All times are divided by what the front takes for a
/// voxel at a typical speed, so that at that speed they are distances in voxels, whatever it is;
/// they count from the front's start, on either side of it.
struct ArrivalBlock {
  using Mask = openvdb::util::NodeMask<3>;
  static constexpr openvdb::Index kSize = 512;

  openvdb::Coord origin;
  std::uint32_t number = 0;
  std::array<float, kSize> time;
  /// Of the typical one; kFar where nothing passes; empty: 1 everywhere.
  std::unique_ptr<std::array<float, kSize>> slowness;
  std::array<ArrivalBlock*, 6> neighbours{};  ///< −x, +x, −y, +y, −z, +z, as far as they exist
  Mask inside;                                ///< behind the front's start
  Mask known;                                 ///< start values, or accepted ones
  Mask firstOrder;  ///< fell back to first order, on one axis or more, where the second was asked

  [[nodiscard]] double slownessAt(openvdb::Index n) const {
    return slowness ? static_cast<double>((*slowness)[n]) : 1.0;
  }
  /// The neighbour in direction d (axis · 2 + (step > 0)) of a grid point: its block, null if there
  /// is none, and its offset there.
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

/// One grid point of which the time is known at the start.
struct StartTime {
  openvdb::Coord gridPoint;
  float time = 0;
};

/// The blocks that a front has come to. They are added one by one, numbered in that order.
class ArrivalBlocks {
 public:
  struct Settings {
    const char* action = "fast-sweeping";
    double until = 0;                                            ///< latest time kept
    std::function<double(const openvdb::Coord&)> slowness = {};  ///< empty: 1
    const openvdb::FloatTree* side = nullptr;          ///< its sign: inside; null: none is
    std::shared_ptr<const PointSources> sources = {};  ///< where the front starts at points
    std::size_t maxMemory = kNoMemoryLimit;
    Progress progress = {};
  };
  explicit ArrivalBlocks(Settings settings);

  /// Makes the blocks of the start and sets their times. @throws InvalidInput when nothing passes
  /// at any of the grid points
  void start(const std::vector<StartTime>& times);
  /// The block, made if it is not there; with `slowness` left for loadSlowness.
  ArrivalBlock& touch(const openvdb::Coord& origin);
  /// Asks for the slowness of the blocks made since it was last called, in parallel.
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
