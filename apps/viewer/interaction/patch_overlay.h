#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/patches/patch.h"
#include "render/camera.h"
#include "render/images/image.h"

namespace viewer {

/// What is drawn of patches.
enum class PatchLines {
  None,
  Outline,  ///< the edges of the space above each
  Base,     ///< the particles on the surface and the lines between them
  All       ///< those of every layer
};

/// @throws levelset::UsageError for a name other than none, outline, base and all
[[nodiscard]] PatchLines patchLinesNamed(const std::string& name);
[[nodiscard]] const char* patchLinesName(PatchLines lines);

/// A picture of bytes to draw on: red, green, blue, alpha for each pixel.
struct Canvas {
  int width = 0, height = 0;
  std::vector<std::uint8_t> colours;
};

/// The same stretched to another size, smoothly. @pre both sizes are positive
[[nodiscard]] Canvas stretched(const Canvas& canvas, int width, int height);

/// Draws patches, from teal at the surface to orange at the top; faintly what lies behind a
/// surface.
/// @param camera     of the canvas' size
/// @param picture    whose depths tell what lies behind a surface, of any size
/// @param tolerance  what lies less far behind is in front, world units
void drawPatches(const std::vector<mapping::Patch>& patches, PatchLines lines,
                 const render::Camera& camera, const render::Image& picture, double tolerance,
                 Canvas& canvas);

}  // namespace viewer
