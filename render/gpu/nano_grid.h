#pragma once

// Private to the GPU renderer: a NanoVDB grid as an array of words for the shader.

#include <string>
#include <vector>

#include "levelset/narrow_band.h"

namespace render {

/// The 32-bit words of a NanoVDB grid, followed by eight background values for outside and eight
/// for inside.
struct NanoGrid {
  std::vector<float> words;
  int root = 0;   ///< word index of the root node
  int tiles = 0;  ///< number of tiles in the root node's table
  int far = 0;    ///< word index of the first of the 16 background values

  /// GLSL text of constants: word offsets of members within NanoVDB's nodes.
  [[nodiscard]] static std::string layout();
};

/// Converts a band to NanoVDB. @pre the band is not empty
/// @throws levelset::ResourceLimit for more words than a 32-bit index can address
[[nodiscard]] NanoGrid makeNanoGrid(const levelset::NarrowBand& band);

}  // namespace render
