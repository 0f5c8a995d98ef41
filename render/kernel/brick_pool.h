#pragma once

#include <Imath/ImathMatrix.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/narrow_band.h"

namespace render {

/// What a ray needs of a band: the values of the blocks of 8³ cells that its surface crosses, and a
/// table that finds them. Plain arrays, as they are uploaded.
///
/// Space is that of the table: the band's index space less `origin`. Blocks, pages of 8³ blocks and
/// empty cubes are aligned in it.
struct BrickPool {
  static constexpr int kEdge = 9;  ///< points of a brick along an axis: 8 cells and the last face
  static constexpr int kValues = kEdge * kEdge * kEdge;
  static constexpr int kMaskWords = 16;  ///< 32 bits each
  static constexpr int kPage = 64;       ///< cells of a page along an axis

  std::array<int, 3> origin{};  ///< index of the point at (0, 0, 0)
  std::array<int, 3> pages{};   ///< along each axis
  /// By x, y, z of the page: where its entries begin; negative, less the edge of an empty cube of
  /// cells that holds it.
  std::vector<std::int32_t> page;
  /// 512 of a page, by x, y, z of the block: the number of its brick; negative as above.
  std::vector<std::int32_t> entry;
  /// kMaskWords of a brick: bit 64x + 8y + z where the corners of the cell differ in sign.
  std::vector<std::uint32_t> mask;
  /// kValues of a brick, φ in the band's unit, by x, y, z.
  std::vector<float> value;
  /// Points between which the crossing cells lie, in the table's space.
  std::array<int, 3> low{}, high{};

  std::size_t blocksLeftOut = 0;  ///< leaves of the band that the surface does not cross
  [[nodiscard]] std::size_t brickCount() const { return value.size() / kValues; }
  [[nodiscard]] std::size_t bytes() const;
};

/// @throws levelset::ResourceLimit for a band whose surface spans more than the table can hold, or
///         more bricks than an index can tell
[[nodiscard]] BrickPool makeBricks(const levelset::NarrowBand& band);

}  // namespace render
