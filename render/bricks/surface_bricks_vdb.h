#pragma once

// Private to the kernel: finds the blocks of a band that its surface crosses.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/vdb.h"
#include "render/bricks/brick_pool.h"
#include "render/filter.h"

namespace render {

/// A block of 8³ cells that the surface crosses, with values and mask in the layout of BrickPool.
struct Brick {
  openvdb::Coord origin;
  std::array<float, BrickPool::kValues> value;
  std::array<std::uint32_t, BrickPool::kMaskWords> mask;
};

/// A block that the surface does not cross, but with points that the stencils of crossed cells
/// read.
struct HaloBlock {
  openvdb::Coord origin;
  openvdb::CoordBBox points = {};  ///< box of the points that stencils read, relative to the origin
  /// Values of the points in the box `points`, ordered by x, y, z. Empty for a block without a
  /// leaf, whose values are all ± the background.
  std::vector<float> value = {};
  bool isInside =
      false;  ///< if `value` is empty: true when the block is far inside, false when far outside
};

/// Builds a copy of the tree in which each leaf value f is replaced by the spline's coefficient f −
/// ∇²f/6.
[[nodiscard]] openvdb::FloatTree::Ptr quasiInterpolated(const openvdb::FloatTree& tree);

/// Blocks that the surface of a band crosses.
struct Bricks {
  std::vector<std::unique_ptr<Brick>> kept;  ///< sorted by origin
  openvdb::CoordBBox crossed;  ///< box of the origins of all crossed blocks, kept or culled
  openvdb::CoordBBox cells;    ///< box of all cells that the surface crosses
  std::size_t culled = 0;      ///< number of crossed blocks that `keeps` rejected
};

/// Finds the blocks that the surface crosses. @param tree  values, or the spline's coefficients
[[nodiscard]] Bricks bricksOf(const openvdb::FloatTree& tree, const TableOptions& options);

/// Finds the halo blocks of the bricks, sorted by origin. @param bricks  crossed blocks of `tree`,
/// sorted by origin
[[nodiscard]] std::vector<HaloBlock> haloBlocks(const openvdb::FloatTree& tree,
                                                const std::vector<std::unique_ptr<Brick>>& bricks);

}  // namespace render
