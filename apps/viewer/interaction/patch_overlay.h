#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/patches/patch.h"
#include "render/camera.h"
#include "render/images/image.h"

namespace viewer {

/// Parts of patches that are drawn.
enum class PatchLines {
  None,
  Outline,  ///< edges of the space above each patch
  Base,     ///< particles on the surface and the lines between them
  All       ///< particles and lines of all layers
};

/// Value for a name. @throws levelset::UsageError for a name other than none, outline, base and all
[[nodiscard]] PatchLines patchLinesNamed(const std::string& name);
[[nodiscard]] const char* patchLinesName(PatchLines lines);

/// An image of bytes: red, green, blue and alpha for each pixel.
struct Canvas {
  int width = 0, height = 0;
  std::vector<std::uint8_t> colours;
};

/// Resamples the canvas smoothly to another size. @pre both sizes are positive
[[nodiscard]] Canvas stretched(const Canvas& canvas, int width, int height);

/// Draws patches in colours from teal at the surface to orange at the top. Lines behind a surface
/// are faint.
/// @param camera  camera with the size of the canvas
/// @param picture  picture, of any size, with the depths of the surfaces
/// @param tolerance  depth difference up to which a line counts as in front, world units
void drawPatches(const std::vector<mapping::Patch>& patches, PatchLines lines,
                 const render::Camera& camera, const render::Image& picture, double tolerance,
                 Canvas& canvas);

}  // namespace viewer
