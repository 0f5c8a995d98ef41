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

namespace render {

/// The values of a band that rays read, and a table that finds them. It holds the blocks of 8³
/// cells that the surface crosses. Of neighbouring blocks it holds the points that stencils for the
/// curvature read. The members are plain arrays, as they are uploaded to the GPU.
///
/// Positions are in table space: the band's index space minus `origin`. Blocks, pages of 8³ blocks
/// and empty cubes are aligned in it.
struct BrickPool {
  static constexpr int kBlock = 8;  ///< cells of a block along an axis
  static constexpr int kEdge =
      kBlock + 1;  ///< points of a brick along an axis, with those of the last face
  static constexpr int kValues = kEdge * kEdge * kEdge;
  static constexpr int kMaskWords = 16;  ///< words of 32 bits
  static constexpr int kPage = 64;       ///< cells of a page along an axis
  static constexpr int kBlocksOfPage = 512;
  /// Offsets from a block's entry to the position of its values, and to their strides.
  static constexpr int kFirstOfEntry = kBlocksOfPage, kStridesOfEntry = 2 * kBlocksOfPage;
  static constexpr std::size_t kCodePadding = 4;  ///< bytes after the last code
  static constexpr int kStrideShift = 8;          ///< the stride along x stands above that along y

  Filter filter = Filter::Trilinear;
  ValueBits quantization = {};
  std::array<int, 3> origin{};  ///< index of the point at (0, 0, 0)
  std::array<int, 3> pages{};   ///< number along each axis
  /// By x, y, z of the page: position of its entries. Negative: minus the edge of an empty cube of
  /// cells that contains the page.
  std::vector<std::int32_t> page;
  /// Three lists of kBlocksOfPage for each page, by x, y, z of the block.
  /// 1. Number of the brick for a block that the surface crosses; otherwise negative, as in `page`.
  /// 2. Position of the value of the block's first point, for each block that a stencil reads. For
  /// blocks other than bricks only a box of points is stored, so that first point may lie outside
  /// it.
  /// 3. Strides of the block's values along x and y. They are 0 where all values are equal.
  std::vector<std::int32_t> entry;
  /// kMaskWords for each brick. Bit 64x + 8y + z is set where the corners of the cell differ in
  /// sign, or where the bounds of the spline do.
  std::vector<std::uint32_t> mask;
  /// φ in the band's unit, or the spline's coefficients, by x, y, z. First kValues for each brick,
  /// then the boxes of the halo blocks. Two rows follow, of values far outside and far inside.
  std::vector<float> value;
  /// Replaces `value` when values are quantized: little-endian codes, followed by padding so that a
  /// 32-bit load of the last code stays in bounds.
  std::vector<std::uint8_t> code;
  /// Range of points of the blocks that the surface crosses, in table space.
  std::array<int, 3> low{}, high{};
  /// Range of the cells that the surface crosses.
  std::array<int, 3> cellsLow{}, cellsHigh{};

  std::size_t haloCount = 0;      ///< neighbouring blocks with some stored points
  std::size_t blocksOmitted = 0;  ///< leaves of the band without stored points
  std::size_t blocksCulled = 0;   ///< crossed blocks that the picture does not need
  [[nodiscard]] std::size_t brickCount() const { return mask.size() / kMaskWords; }
  [[nodiscard]] std::size_t valueBytes() const {
    return code.empty() ? value.size() * sizeof value[0] : code.size() - kCodePadding;
  }
  [[nodiscard]] std::size_t bytes() const;
};

/// Options of makeBricks().
struct TableOptions {
  Filter filter = Filter::Trilinear;
  ValueBits quantization =
      {};  ///< @pre the values are multiples of its step, as are the coefficients of a spline
  /// Returns false for balls in index space that may be culled. Empty: nothing is culled.
  std::function<bool(const Imath::V3d& centre, double radius)> keeps = {};
};

/// Builds the bricks of a band.
/// @throws levelset::ResourceLimit for a surface that spans more than the table can hold, or for
///         more values than an index can address
[[nodiscard]] BrickPool makeBricks(const levelset::NarrowBand& band,
                                   const TableOptions& options = {});

}  // namespace render
