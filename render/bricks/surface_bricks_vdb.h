#pragma once

// Private to the kernel: finds the blocks of a grid that its surface crosses.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/vdb.h"
#include "render/bricks/brick_pool.h"
#include "render/filter.h"
#include "render/volumes/volume_surface.h"

namespace render {

/// A block of 8³ cells that the surface crosses, with values and mask in the layout of BrickPool.
struct Brick {
  openvdb::Coord origin;
  std::vector<float> value = std::vector<float>(BrickPool::kValues);
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

/// Reads the values of a grid, or its spline coefficients. Each thread has its own reader.
class GridReader {
 public:
  virtual ~GridReader() = default;
  /// Copies a block of 8³ grid points and those around it, ordered by x, y, z.
  /// @param before, after  number of grid points before and after the block on each axis, at most 3
  virtual void copyPadded(const openvdb::Coord& origin, int before, int after, float* out) = 0;
  /// Reads the values of the points in `block.points`.
  virtual void read(HaloBlock& block) = 0;
};

/// Grid whose surface is drawn.
class GridSource {
 public:
  virtual ~GridSource() = default;
  /// Origins of the blocks that may hold a crossed cell, sorted, without duplicates.
  [[nodiscard]] virtual std::vector<openvdb::Coord> blocks() const = 0;
  /// Box of the cells in which the surface is drawn.
  [[nodiscard]] virtual openvdb::CoordBBox cells() const { return openvdb::CoordBBox::inf(); }
  /// Number of blocks of the grid, and if a block is one of them.
  [[nodiscard]] virtual std::size_t storedBlocks() const = 0;
  [[nodiscard]] virtual bool isStored(const openvdb::Coord& origin) const = 0;
  [[nodiscard]] virtual std::unique_ptr<GridReader> reader() const = 0;
};

/// Values of a tree. @pre the tree outlives the source
[[nodiscard]] std::unique_ptr<GridSource> treeSource(const openvdb::FloatTree& tree);
/// Samples of a volume's field, or for Filter::BSplineQi the spline's coefficients.
/// @pre the surface outlives the source
[[nodiscard]] std::unique_ptr<GridSource> volumeSource(const VolumeSurface& surface, Filter filter);

/// Builds a copy of the tree in which each leaf value f is replaced by the spline's coefficient f −
/// ∇²f/6.
[[nodiscard]] openvdb::FloatTree::Ptr quasiInterpolated(const openvdb::FloatTree& tree);

/// Copies the data around the cells of a block, and sets the mask bits of the cells in which a
/// spline on tetrahedra may cross zero: those whose Bernstein coefficients differ in sign.
void fillCubes(GridReader& grid, Filter filter, Brick& brick);

/// Computes the numbers of the sites around a block for Filter::BccQuadratic. Sets the mask bits of
/// the cells in which bounds on the Bernstein coefficients allow a zero.
void fillSites(GridReader& grid, Brick& brick);

/// Blocks that the surface of a grid crosses.
struct Bricks {
  std::vector<std::unique_ptr<Brick>> kept;  ///< sorted by origin
  openvdb::CoordBBox crossed;  ///< box of the origins of all crossed blocks, kept or culled
  openvdb::CoordBBox cells;    ///< box of all cells that the surface crosses
  std::size_t culled = 0;      ///< number of crossed blocks that `keeps` rejected
};

/// Finds the blocks that the surface crosses.
[[nodiscard]] Bricks bricksOf(const GridSource& grid, const TableOptions& options);

/// Finds the halo blocks of the bricks, sorted by origin. @param bricks  crossed blocks of `grid`,
/// sorted by origin
[[nodiscard]] std::vector<HaloBlock> haloBlocks(const GridSource& grid,
                                                const std::vector<std::unique_ptr<Brick>>& bricks);

}  // namespace render
