#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "levelset/narrow_band.h"
#include "render/filter.h"
#include "render/images/value_bits.h"
#include "render/volumes/volume_surface.h"

namespace render {

/// Values of a band or volume that the kernel's rays read, and a two-level table that finds them by
/// position. The pool holds all values of the blocks of 8³ cells that the surface crosses (bricks).
/// Neighbouring blocks (halo blocks) are stored in part: only the points that curvature stencils
/// read. The members are plain arrays, so that they can be uploaded to the GPU.
///
/// Positions are in table space: the band's index space minus `origin`. Blocks, pages of 8³ blocks
/// and empty cubes start at multiples of their edge there. For filters on tetrahedra, positions are
/// larger by half a voxel, so that the grid point n lies in the middle of cell n. Their tables and
/// those of Filter::BccQuadratic have no halo blocks.
struct BrickPool {
  static constexpr int kBlock = 8;  ///< cells of a block along an axis
  static constexpr int kEdge =
      kBlock + 1;  ///< grid points of a brick along an axis, with those of its last face
  static constexpr int kValues = kEdge * kEdge * kEdge;
  /// The same for filters on tetrahedra: a brick then has the 27 data around each cell, from one
  /// point before the block on.
  static constexpr int kCubeEdge = kBlock + 2;
  static constexpr int kCubeValues = kCubeEdge * kCubeEdge * kCubeEdge;
  /// For Filter::BccQuadratic a brick has four numbers for each site of the lattice in the 12³
  /// cells from two cells before the block on: mean and half differences along x, y, z of the eight
  /// values around the site. Sites with even numbers come first, then those with odd ones.
  static constexpr int kSites = 2 * 6 * 6 * 6;
  static constexpr int kMaskWords =
      16;  ///< 32-bit words of a brick's mask, which has a bit for each cell
  static constexpr int kPage = 64;  ///< cells along an axis of a page, which has 8³ blocks
  static constexpr int kBlocksOfPage = 512;
  /// Offsets in `entry` from a block's item of list 1 to its items of list 2 and of list 3 (see
  /// `entry`).
  static constexpr int kFirstOfEntry = kBlocksOfPage, kStridesOfEntry = 2 * kBlocksOfPage;
  static constexpr std::size_t kCodePadding = 4;  ///< padding after the last value in `code`, bytes
  static constexpr int kStrideShift =
      8;  ///< list 3 packs (stride along x) << kStrideShift | (stride along y)

  Filter filter = Filter::Trilinear;
  ValueBits quantization = {};
  std::array<int, 3> origin{};  ///< position (0, 0, 0) of table space, in the band's index space
  std::array<int, 3> pages{};   ///< number of pages along each axis
  /// An item for each page, ordered by x, y, z: position of the page's lists in `entry`. An empty
  /// page has a negative item: minus the edge, in cells, of an aligned empty cube that contains the
  /// page.
  std::vector<std::int32_t> page;
  /// Three lists of kBlocksOfPage items for each page that is not empty, ordered by x, y, z of the
  /// block.
  /// 1. Number of the brick for a block that the surface crosses. Otherwise negative, as in `page`:
  /// minus the edge of an empty cube, in cells.
  /// 2. Position of the value of the block's first point, for each block that a stencil reads. For
  /// blocks other than bricks only a box of points is stored, and the first point of the block may
  /// lie outside that box.
  /// 3. Strides of the block's values along x and y. They are 0 where all values are equal.
  std::vector<std::int32_t> entry;
  /// kMaskWords words for each brick. Bit 64x + 8y + z is set when the surface may cross cell (x,
  /// y, z): its corners differ in sign, or, for a spline filter, bounds on the spline do.
  std::vector<std::uint32_t> mask;
  /// φ or the spline's coefficients, world units, ordered by x, y, z. First brickValues() values
  /// for each brick, then the stored box of each halo block. Then kBlock times the background, for
  /// blocks far outside, and kBlock times minus the background, for blocks far inside.
  std::vector<float> value;
  /// Replaces `value` when values are quantized: little-endian codes, followed by padding so that a
  /// 32-bit load of the last code stays in bounds.
  std::vector<std::uint8_t> code;
  /// Range of the grid points of the blocks that the surface crosses, in table space.
  std::array<int, 3> low{}, high{};
  /// Range of the cells that the surface crosses, in table space; the upper end is exclusive.
  std::array<int, 3> cellsLow{}, cellsHigh{};

  std::size_t haloCount = 0;  ///< halo blocks with stored points
  /// Leaf nodes of the band, or blocks of the volume, of which the pool stores no point.
  std::size_t blocksOmitted = 0;
  std::size_t blocksCulled = 0;  ///< blocks that the surface crosses but the picture does not need
  /// Number of values of a brick.
  [[nodiscard]] std::size_t brickValues() const {
    return tetrahedralDegree(filter) > 0    ? kCubeValues
           : filter == Filter::BccQuadratic ? 4 * kSites
                                            : kValues;
  }
  /// Distance from positions in index space to those in table space before `origin` is subtracted.
  [[nodiscard]] double shift() const { return tetrahedralDegree(filter) > 0 ? 0.5 : 0; }
  [[nodiscard]] std::size_t brickCount() const { return mask.size() / kMaskWords; }
  [[nodiscard]] std::size_t valueBytes() const {
    return code.empty() ? value.size() * sizeof value[0] : code.size() - kCodePadding;
  }
  [[nodiscard]] std::size_t bytes() const;
  /// Item i of `value`, or of `code` as the number that it stands for.
  [[nodiscard]] double valueAt(std::size_t i) const;
};

/// Options of makeBricks().
struct TableOptions {
  Filter filter = Filter::Trilinear;
  /// Storage of the values in the pool. @pre below 32 bits, each value of the band is one of its
  /// quantized values
  ValueBits quantization = {};
  /// Returns false for a ball in index space that the picture does not need. Blocks in such balls
  /// are culled. Empty: no block is culled.
  std::function<bool(const Imath::V3d& centre, double radius)> keeps = {};
};

/// Builds the brick pool of a band.
/// @throws levelset::ResourceLimit for a surface that spans more than the table can hold (8192
///         voxels), or for more values than a 32-bit index can address
[[nodiscard]] BrickPool makeBricks(const levelset::NarrowBand& band,
                                   const TableOptions& options = {});
/// Builds the brick pool of an isosurface of a volume: positions are in the volume's index space,
/// and values are those of its field. @pre options.quantization has 32 bits
/// @throws as above
[[nodiscard]] BrickPool makeBricks(const VolumeSurface& surface, const TableOptions& options = {});

}  // namespace render
