#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstdint>
#include <vector>

namespace levelset {

/// Removes all but the first of triangles with the same corners: the walls of parts that were
/// meshed one by one are there twice, with opposite orientations.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> withoutDoubles(
    std::vector<std::array<std::uint32_t, 3>> triangles);

}  // namespace levelset
