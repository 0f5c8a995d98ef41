#pragma once

// Private to the kernel: the blocks of a band that its surface crosses.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/vdb.h"
#include "render/bricks/brick_pool.h"
#include "render/filter.h"

namespace render {

/// A block of 8³ cells that the surface crosses, as BrickPool holds it.
struct Brick {
  openvdb::Coord origin;
  std::array<float, BrickPool::kValues> value;
  std::array<std::uint32_t, BrickPool::kMaskWords> mask;
};

/// A block that it does not, of which the shape of the surface takes some points.
struct HaloBlock {
  openvdb::Coord origin;
  openvdb::CoordBBox points = {};  ///< that hold those, from the origin on
  std::vector<float> value = {};   ///< of them by x, y, z; none where all are alike: far away
  bool isInside = false;           ///< far away
};

/// The spline's coefficients f − ∇²f/6 in the place of the values, in leaves.
[[nodiscard]] openvdb::FloatTree::Ptr quasiInterpolated(const openvdb::FloatTree& tree);

struct Bricks {
  std::vector<std::unique_ptr<Brick>> kept;  ///< in the order of their origins
  openvdb::CoordBBox crossed;                ///< origins of all that are crossed
  openvdb::CoordBBox cells;                  ///< that are, of all
  std::size_t culled = 0;
};

/// @param tree  of values, or of the spline's coefficients
[[nodiscard]] Bricks bricksOf(const openvdb::FloatTree& tree, const TableOptions& options);

/// In the order of their origins. @param bricks  of that tree
[[nodiscard]] std::vector<HaloBlock> haloBlocks(const openvdb::FloatTree& tree,
                                                const std::vector<std::unique_ptr<Brick>>& bricks);

}  // namespace render
