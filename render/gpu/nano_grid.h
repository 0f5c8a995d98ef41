#pragma once

// Private to the GPU renderer: a NanoVDB grid as the shader reads it.

#include <string>
#include <vector>

#include "levelset/narrow_band.h"

namespace render {

/// The words of a NanoVDB grid, and behind them eight values far outside and eight far inside.
struct NanoGrid {
  std::vector<float> words;
  int root = 0;   ///< place of the root node
  int tiles = 0;  ///< of it
  int far = 0;    ///< place of the values behind the grid

  /// Places within nodes, as GLSL constants.
  [[nodiscard]] static std::string layout();
};

/// @pre the band is not empty
/// @throws levelset::ResourceLimit for more words than an index can tell
[[nodiscard]] NanoGrid makeNanoGrid(const levelset::NarrowBand& band);

}  // namespace render
