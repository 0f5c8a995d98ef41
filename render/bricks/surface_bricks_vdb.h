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

/// A block of 8³ cells that the surface crosses, as BrickPool stores it.
struct Brick {
  openvdb::Coord origin;
  std::array<float, BrickPool::kValues> value;
  std::array<std::uint32_t, BrickPool::kMaskWords> mask;
};

/// A block that the surface does not cross, but whose points stencils of crossed cells read.
struct HaloBlock {
  openvdb::Coord origin;
  openvdb::CoordBBox points = {};  ///< box of the points that are read, relative to the origin
  std::vector<float> value =
      {};  ///< values of these points by x, y, z; empty where all equal the background
  bool isInside = false;  ///< sign of the background value, if `value` is empty
};

/// Builds a tree with the spline's coefficients f − ∇²f/6 in place of the values, in leaves.
[[nodiscard]] openvdb::FloatTree::Ptr quasiInterpolated(const openvdb::FloatTree& tree);

/// The blocks that the surface of a band crosses.
struct Bricks {
  std::vector<std::unique_ptr<Brick>> kept;  ///< sorted by origin
  openvdb::CoordBBox crossed;  ///< box of the origins of all crossed blocks, kept or culled
  openvdb::CoordBBox cells;    ///< box of all crossed cells
  std::size_t culled = 0;
};

/// Finds the crossed blocks. @param tree  values, or the spline's coefficients
[[nodiscard]] Bricks bricksOf(const openvdb::FloatTree& tree, const TableOptions& options);

/// Finds the halo blocks, sorted by origin. @param bricks  crossed blocks of the same tree
[[nodiscard]] std::vector<HaloBlock> haloBlocks(const openvdb::FloatTree& tree,
                                                const std::vector<std::unique_ptr<Brick>>& bricks);

}  // namespace render
