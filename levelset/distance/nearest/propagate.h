#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <atomic>
#include <deque>
#include <unordered_map>

#include "levelset/distance/surface/surface_points.h"
#include "levelset/progress.h"

namespace levelset::eikonal {

/// Finds the nearest of the SurfacePoints for each grid point near the zero set. Each grid point
/// offers its nearest surface point to its 26 neighbours, until no grid point gets a nearer one.
/// Inside a leaf block, a queue holds the grid points that must make offers. Between blocks, the
/// algorithm runs in rounds over the eight parities of the block positions. Blocks of one parity
/// never touch, so they run in parallel; the order, and so the result, is fixed.
class NearestPoints {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  using Mask = openvdb::util::NodeMask<3>;

  struct Block {
    openvdb::Coord origin;
    std::array<std::uint32_t, 512> nearest;  ///< index of the nearest surface point, or kNone
    /// Squared distance to the nearest surface point, voxels². If there is none yet: the square of
    /// the largest distance to compute plus a margin.
    std::array<float, 512> squared;
    Mask inside;  ///< grid points with φ < 0
    /// Grid points beside the zero set whose nearest surface point is the one found for themselves.
    Mask own;
    /// The 26 neighbour blocks, x slowest; null: no block. Entry 13, the block itself, is null.
    std::array<Block*, 27> neighbours{};
    /// Bounds of the block's grid points in the region, inclusive, relative to `origin`.
    openvdb::Coord low, high;
    /// Bit i is set when neighbour i has changed at the shared border and this block has not read
    /// the change.
    std::atomic<std::uint32_t> dirtyNeighbours = 0;
    Mask queued;  ///< grid points that must offer their surface point to their neighbours
  };

  /// Grid points for which a nearest surface point is searched.
  struct Reach {
    double inside = 3, outside = 3;                 ///< largest distances from the zero set, voxels
    std::optional<openvdb::CoordBBox> region = {};  ///< box of the grid points; empty: no limit
    const openvdb::MaskTree* leaves = nullptr;  ///< only blocks with a leaf there; null: no limit
  };

  /// Returns the nearest surface point of a grid point in or near a block; kNone if there is none.
  [[nodiscard]] static std::uint32_t nearestAt(const Block& block,
                                               const openvdb::Coord& gridPoint) {
    const Block* at = &block;
    while (at) {
      const openvdb::Coord local = gridPoint - at->origin;
      const openvdb::Coord step((local.x() > 7) - (local.x() < 0),
                                (local.y() > 7) - (local.y() < 0),
                                (local.z() > 7) - (local.z() < 0));
      if (step == openvdb::Coord(0))
        return at->nearest[openvdb::FloatTree::LeafNodeType::coordToOffset(local)];
      at = at->neighbours[static_cast<std::size_t>((step.x() + 1) * 9 + (step.y() + 1) * 3 +
                                                   step.z() + 1)];
    }
    return kNone;
  }

  NearestPoints(const openvdb::FloatTree& field, const SurfacePoints& points, const Reach& reach);
  void run(const Progress& progress);

  [[nodiscard]] const std::deque<Block>& blocks() const { return blocks_; }
  /// Returns the block that begins at `origin`; null: none.
  [[nodiscard]] const Block* find(const openvdb::Coord& origin) const {
    const auto found = index_.find(origin);
    return found == index_.end() ? nullptr : found->second;
  }

 private:
  Block& touch(const openvdb::Coord& origin);
  void seedBesideSurface();
  void seedRegionBoundary();
  void seed(const openvdb::Coord& gridPoint, std::uint32_t point, bool own);
  void process(Block& block, std::vector<openvdb::Coord>& missing) const;

  const openvdb::FloatTree& field_;
  openvdb::FloatGrid::ConstAccessor accessor_;
  const SurfacePoints& points_;
  Reach reach_;
  std::deque<Block> blocks_;
  std::unordered_map<openvdb::Coord, Block*, std::hash<openvdb::Coord>> index_;
};

}  // namespace levelset::eikonal
