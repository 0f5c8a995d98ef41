#pragma once

#include <Imath/ImathMatrix.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/narrow_band.h"
#include "render/filter.h"

namespace render {

/// What a ray needs of a band: the values of the blocks of 8³ cells that its surface crosses, and
/// of those beside them that tell its curvature, and a table that finds them. Plain arrays, as they
/// are uploaded.
///
/// Space is that of the table: the band's index space less `origin`. Blocks, pages of 8³ blocks and
/// empty cubes are aligned in it.
struct BrickPool {
  static constexpr int kEdge = 9;  ///< points of a brick along an axis: 8 cells and the last face
  static constexpr int kValues = kEdge * kEdge * kEdge;
  static constexpr int kMaskWords = 16;  ///< 32 bits each
  static constexpr int kPage = 64;       ///< cells of a page along an axis
  static constexpr int kBlocksOfPage = 512;
  static constexpr std::size_t kFarBricks = 2;         ///< all outside, all inside
  static constexpr int kBlockOfEntry = kBlocksOfPage;  ///< on from a block's entry, its values

  Filter filter = Filter::Trilinear;
  std::array<int, 3> origin{};  ///< index of the point at (0, 0, 0)
  std::array<int, 3> pages{};   ///< along each axis
  /// By x, y, z of the page: where its entries begin; negative, less the edge of an empty cube of
  /// cells that holds it.
  std::vector<std::int32_t> page;
  /// For each page two lists of kBlocksOfPage, by x, y, z of the block. First, for blocks that the
  /// surface crosses, the number of the brick; negative as above for others. Then the number of the
  /// brick that holds the values, for whatever lies within two points before or three behind the
  /// first corner of a cell that the surface crosses.
  std::vector<std::int32_t> entry;
  /// kMaskWords of a brick that is crossed, those first: bit 64x + 8y + z where the corners of the
  /// cell differ in sign, or the bounds of the spline do.
  std::vector<std::uint32_t> mask;
  /// kValues of a brick, φ in the band's unit or the spline's coefficients, by x, y, z.
  std::vector<float> value;
  /// Points between which the crossing cells lie, in the table's space.
  std::array<int, 3> low{}, high{};

  std::size_t blocksLeftOut = 0;  ///< leaves of the band that are not held
  /// Those that the surface crosses.
  [[nodiscard]] std::size_t brickCount() const { return mask.size() / kMaskWords; }
  /// Of all that are held: with those beside them, and the two that are far away.
  [[nodiscard]] std::size_t heldCount() const { return value.size() / kValues; }
  [[nodiscard]] std::size_t besideCount() const {
    return heldCount() == 0 ? 0 : heldCount() - brickCount() - kFarBricks;
  }
  [[nodiscard]] std::size_t bytes() const;
};

/// @throws levelset::ResourceLimit for a band whose surface spans more than the table can hold, or
///         more bricks than an index can tell
[[nodiscard]] BrickPool makeBricks(const levelset::NarrowBand& band,
                                   Filter filter = Filter::Trilinear);

}  // namespace render
