#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <atomic>
#include <deque>
#include <unordered_map>

#include "levelset/distance/surface_points.h"
#include "levelset/progress.h"

namespace levelset::eikonal {

/// For each grid point near the zero set, the nearest of the surface points.
///
/// Grid points hand what they have to their 26 neighbours until nothing improves. Inside a leaf
/// block that runs by a queue; between blocks by rounds over the eight parities of their positions.
/// Blocks of one parity never touch, so they run in parallel and the order, hence the result, is
/// fixed.
class NearestPoints {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  using Mask = openvdb::util::NodeMask<3>;

  struct Block {
    openvdb::Coord origin;
    std::array<std::uint32_t, 512> nearest;  ///< number of the surface point
    std::array<float, 512> squared;          ///< to it, voxels²; without it, what is out of reach
    Mask inside;                             ///< φ < 0
    Mask own;  ///< holds the surface point that was found for this very grid point
    std::array<Block*, 27> neighbours{};  ///< as far as they exist
    openvdb::Coord low, high;             ///< grid points of the block in the region, inclusive
    std::atomic<std::uint32_t> dirtyNeighbours =
        0;        ///< bit i: neighbour i has something new at the border
    Mask queued;  ///< has something new for the grid points around it
  };

  struct Reach {
    double inside = 3, outside = 3;  ///< voxels
    std::optional<openvdb::CoordBBox> region = {};
  };

  NearestPoints(const openvdb::FloatTree& field, const SurfacePoints& points, const Reach& reach);
  void run(const Progress& progress, const char* action);

  [[nodiscard]] const std::deque<Block>& blocks() const { return blocks_; }
  [[nodiscard]] bool holds(const openvdb::Coord& origin) const { return index_.count(origin) > 0; }

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
