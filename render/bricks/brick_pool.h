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

/// What a ray needs of a band: the values of the blocks of 8³ cells that its surface crosses, and
/// of those beside them that tell its curvature, and a table that finds them. Plain arrays, as they
/// are uploaded.
///
/// Space is that of the table: the band's index space less `origin`. Blocks, pages of 8³ blocks and
/// empty cubes are aligned in it.
struct BrickPool {
  static constexpr int kBlock = 8;  ///< cells of a block along an axis
  static constexpr int kEdge =
      kBlock + 1;  ///< points of a brick along an axis: of its last face too
  static constexpr int kValues = kEdge * kEdge * kEdge;
  static constexpr int kMaskWords = 16;  ///< 32 bits each
  static constexpr int kPage = 64;       ///< cells of a page along an axis
  static constexpr int kBlocksOfPage = 512;
  /// On from a block's entry: where its values begin, and their strides.
  static constexpr int kFirstOfEntry = kBlocksOfPage, kStridesOfEntry = 2 * kBlocksOfPage;
  static constexpr std::size_t kCodePadding = 4;  ///< bytes behind the last code
  static constexpr int kStrideShift = 8;          ///< of that along x, above that along y

  Filter filter = Filter::Trilinear;
  ValueBits quantization = {};
  std::array<int, 3> origin{};  ///< index of the point at (0, 0, 0)
  std::array<int, 3> pages{};   ///< along each axis
  /// By x, y, z of the page: where its entries begin; negative, less the edge of an empty cube of
  /// cells that holds it.
  std::vector<std::int32_t> page;
  /// For each page three lists of kBlocksOfPage, by x, y, z of the block. First, for blocks that
  /// the surface crosses, the number of the brick; negative as above for others. Then, for these
  /// and for whatever a cell's stencil reaches beside them, where the value of the block's first
  /// point is or would be, for of others than bricks a box of points is held; and the strides of
  /// its values along x and along y, which are 0 where all are alike.
  std::vector<std::int32_t> entry;
  /// kMaskWords of a brick: bit 64x + 8y + z where the corners of the cell differ in sign, or the
  /// bounds of the spline do.
  std::vector<std::uint32_t> mask;
  /// φ in the band's unit or the spline's coefficients, by x, y, z: kValues of each brick, then of
  /// the boxes beside them, and rows that are far outside and far inside.
  std::vector<float> value;
  /// In place of these, where they are held in fewer bits, the least first; and room behind the
  /// last one for a load of 32 bits.
  std::vector<std::uint8_t> code;
  /// Points between which the blocks lie that the surface crosses, in the table's space.
  std::array<int, 3> low{}, high{};
  /// And the cells that it crosses.
  std::array<int, 3> cellsLow{}, cellsHigh{};

  std::size_t haloCount = 0;      ///< blocks of which some points are held
  std::size_t blocksOmitted = 0;  ///< leaves of the band of which nothing is
  std::size_t blocksCulled = 0;   ///< that are crossed, and not needed
  [[nodiscard]] std::size_t brickCount() const { return mask.size() / kMaskWords; }
  [[nodiscard]] std::size_t valueBytes() const {
    return code.empty() ? value.size() * sizeof value[0] : code.size() - kCodePadding;
  }
  [[nodiscard]] std::size_t bytes() const;
};

struct TableOptions {
  Filter filter = Filter::Trilinear;
  ValueBits quantization = {};  ///< @pre the values are of these, the coefficients of a spline too
  /// Is anything of a ball in index space needed? What is not is left out. Empty: everything is.
  std::function<bool(const Imath::V3d& centre, double radius)> keeps = {};
};

/// @throws levelset::ResourceLimit for a band whose surface spans more than the table can hold, or
///         more values than an index can tell
[[nodiscard]] BrickPool makeBricks(const levelset::NarrowBand& band,
                                   const TableOptions& options = {});

}  // namespace render
