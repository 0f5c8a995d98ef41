#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstdint>
#include <vector>

namespace levelset {

/// Turns triangles over so that neighbours of one sheet face the same way. A sheet that cannot be
/// oriented, as a Möbius strip, keeps a line across which they do not.
/// @param isSheet  by triangle; the others stay
void orientSheets(std::vector<std::array<std::uint32_t, 3>>& triangles,
                  const std::vector<char>& isSheet);

}  // namespace levelset
