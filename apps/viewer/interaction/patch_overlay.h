#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mapping/patches/patch.h"
#include "render/camera.h"
#include "render/images/image.h"

namespace viewer {

/// Choice of the lines and particles of patches that are drawn.
enum class PatchLines {
  None,
  Outline,  ///< borders of the lowest and the highest layer, and the lines that join their corners
  Base,     ///< particles of the lowest layer, on the surface, and the lines between them
  All       ///< particles and lines of all layers
};

/// Finds the PatchLines value with a name. @throws levelset::UsageError for a name other than none,
/// outline, base and all
[[nodiscard]] PatchLines patchLinesNamed(const std::string& name);
[[nodiscard]] const char* patchLinesName(PatchLines lines);

/// An image of bytes: red, green, blue and alpha for each pixel.
struct Canvas {
  int width = 0, height = 0;
  std::vector<std::uint8_t> colours;
};

/// Resamples the canvas to another size by bilinear interpolation. @pre the sizes are positive
[[nodiscard]] Canvas stretched(const Canvas& canvas, int width, int height);

/// Draws patches, in colours from teal for the lowest layer, on the surface, to orange for the
/// highest layer. Lines behind a surface are faint.
/// @param camera  camera whose width and height are those of the canvas
/// @param picture  picture of the same view, of any size; its layer Z (depth) decides if a line is
/// behind a surface
/// @param tolerance  depth behind a surface up to which a line still counts as in front, world
/// units
void drawPatches(const std::vector<mapping::Patch>& patches, PatchLines lines,
                 const render::Camera& camera, const render::Image& picture, double tolerance,
                 Canvas& canvas);

}  // namespace viewer
