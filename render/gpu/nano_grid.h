#pragma once

// Private to the GPU renderer: a NanoVDB grid as the shader reads it.

#include <string>
#include <vector>

#include "levelset/narrow_band.h"

namespace render {

/// The words of a NanoVDB grid, followed by eight values far outside and eight far inside.
struct NanoGrid {
  std::vector<float> words;
  int root = 0;   ///< word index of the root node
  int tiles = 0;  ///< number of its tiles
  int far = 0;    ///< word index of the values after the grid

  /// GLSL constants with the offsets of members within nodes.
  [[nodiscard]] static std::string layout();
};

/// Converts a band. @pre the band is not empty
/// @throws levelset::ResourceLimit for more words than an index can address
[[nodiscard]] NanoGrid makeNanoGrid(const levelset::NarrowBand& band);

}  // namespace render
