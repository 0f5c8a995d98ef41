#pragma once

// Internal header of levelset: public headers must not include it.

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

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

  /// One number for each grid point of a block. Has the size of the values of a leaf, so that
  /// released memory of one kind serves the other.
  template <typename T>
  class Numbers {
   public:
    [[nodiscard]] T& operator[](std::size_t n) { return numbers_[n]; }
    [[nodiscard]] const T& operator[](std::size_t n) const { return numbers_[n]; }
    [[nodiscard]] const T* begin() const { return numbers_.get(); }
    void release() { numbers_.reset(); }

   private:
    std::unique_ptr<T[]> numbers_ = std::make_unique_for_overwrite<T[]>(512);
  };

  struct Block {
    openvdb::Coord origin;
    Numbers<std::uint32_t> nearest;  ///< index of the nearest surface point, or kNone
    /// Squared distance to the nearest surface point, voxels². If there is none yet: the square of
    /// the largest distance to compute plus a margin. Released once the distances of the block are
    /// computed.
    Numbers<float> squared;
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

  /// Gives surface points to their grid points. Seeds must come before those of seedFeatures() in
  /// the same slab.
  /// @param first  number of the first surface point
  void seed(const std::vector<openvdb::Coord>& gridPoints, std::size_t first);
  /// Offers the points on edges and corners to the corners of the grid cells that contain them.
  /// Such a point may be nearer to a grid point than all points on faces.
  /// @param first  number of the first of these points
  void seedFeatures(std::size_t first);
  /// As above, for the grid points of one slab.
  void seedFeatures(std::size_t first, int slab);
  /// Gives the nearest surface points to the grid points at the boundary of the region.
  /// @param gridPoints  grid points of the surface points
  void seedRegionBoundary(const std::vector<openvdb::Coord>& gridPoints);

  /// Propagates all surface points that were seeded.
  void run(const Progress& progress);

  // A slab has all blocks with the same x, and is numbered by x / 8. A block reads only its
  // neighbours, so the rounds need not run over all slabs at once: advance(g) runs round j of the
  // slabs 2 (g − j) and 2 (g − j) − 1, for all j. Each block then sees its neighbours in the same
  // states as in rounds over all blocks, and gets the same bits.

  [[nodiscard]] static int slabOf(const openvdb::Coord& gridPoint) { return gridPoint.x() >> 3; }
  /// Sets the first and the last slab that can get a block.
  void beginAt(int slab, int last) {
    final_ = slab - 1;
    reachInSlabs_ = std::min(reachInSlabs_, last - slab + 1);
  }
  /// Runs one round of each slab up to 2g. Slabs up to 2g + 1 must be seeded.
  void advance(int g);
  /// Last slab whose blocks do not change any more. A slab is final when neither it nor the slabs
  /// after it that a surface point can reach have anything to do. Later offers to it are ignored.
  [[nodiscard]] int lastFinal() const { return final_; }
  /// Range of the slabs that have blocks. @pre there are blocks
  [[nodiscard]] int firstSlab() const { return slabs_.begin()->first; }
  [[nodiscard]] int lastSlab() const { return slabs_.rbegin()->first; }
  /// Returns the blocks of a slab.
  [[nodiscard]] std::vector<Block*> blocksOf(int slab) const;
  /// Deletes the blocks of the slabs up to `slab`.
  void releaseUpTo(int slab);

  /// Returns the block that begins at `origin`; null: none.
  [[nodiscard]] const Block* find(const openvdb::Coord& origin) const {
    const auto found = index_.find(origin);
    return found == index_.end() ? nullptr : found->second;
  }

 private:
  /// Blocks of a slab by the parities of y and z.
  using Slab = std::array<std::vector<std::unique_ptr<Block>>, 4>;

  Block& touch(const openvdb::Coord& origin);
  void seed(const openvdb::Coord& gridPoint, std::uint32_t point, bool own);
  void seedCorners(std::size_t point, std::optional<int> slab);
  void process(Block& block, std::vector<openvdb::Coord>& missing) const;
  void runRound(int slab);
  [[nodiscard]] bool isQuiet(int slab) const;

  const openvdb::FloatTree& field_;
  openvdb::FloatGrid::ConstAccessor accessor_;
  const SurfacePoints& points_;
  Reach reach_;
  std::map<int, Slab> slabs_;
  int final_ = 0;
  int reachInSlabs_;  ///< number of slabs to which a surface point can reach on each side
  std::map<int, std::vector<std::size_t>> features_;  ///< points on edges and corners, by slab
  std::unordered_map<openvdb::Coord, Block*, std::hash<openvdb::Coord>> index_;
};

}  // namespace levelset::eikonal
