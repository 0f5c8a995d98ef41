#pragma once

// Private to the ray casting of quadrics: builds trees of boxes with eight children.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/quadrics/quadric_tables.h"

namespace render {

/// Box of a primitive, and its number.
struct PrimitiveBox {
  float low[3];
  std::uint32_t number;
  float high[3];
  std::uint32_t unused;
};

/// Tree over blocks of primitives. The places of block n are order[width·n … width·(n + 1)).
struct BuiltTree {
  std::vector<QuadricNode> nodes;    ///< the root is first
  std::vector<std::uint32_t> order;  ///< numbers of the primitives by place; kEmptyPlace: none
};
inline constexpr std::uint32_t kEmptyPlace = 0xffffffffU;

/// Builds a tree by the surface area heuristic, in parallel. The result depends on the boxes alone.
/// @param boxes  not empty; they are reordered
/// @param width  largest number of primitives in a block
[[nodiscard]] BuiltTree buildQuadricTree(std::vector<PrimitiveBox>& boxes, std::size_t width);

}  // namespace render
