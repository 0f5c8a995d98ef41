#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "render/images/image.h"

namespace viewer {

/// What is shown of a picture.
enum class Layer { Colour, Normal, Depth, Position, MeanCurvature, GaussCurvature, K1, K2, Id };

inline constexpr std::array<Layer, 9> kLayers = {
    Layer::Colour,         Layer::Normal, Layer::Depth, Layer::Position, Layer::MeanCurvature,
    Layer::GaussCurvature, Layer::K1,     Layer::K2,    Layer::Id};

/// As options and menus write it: "colour", "normal", …
[[nodiscard]] const char* layerName(Layer layer);
/// @throws levelset::UsageError, with what there is, for a name of none
[[nodiscard]] Layer layerNamed(const std::string& name);

/// Red, green, blue from 0 to 1 as they are shown.
using DisplayColour = std::array<double, 3>;

/// From −1 to 1: blue over white to red; beyond it the same as at the ends.
[[nodiscard]] DisplayColour divergingColour(double value);
/// Each number another colour, 0 grey.
[[nodiscard]] DisplayColour idColour(std::uint32_t id);

/// Four bytes for each pixel, red, green, blue, alpha; nothing where nothing is hit.
/// Colour: as a PNG of it. Normals: x, y, z from −1 to 1 as red, green, blue. Depth: white the
/// nearest, dark the farthest of the picture. Positions: as normals are, within the box of what the
/// picture shows. Curvatures times the extent (Gauss': its square), from −range to range.
/// @param extent  of the surfaces, world units
/// @param range   of curvatures, by the extent; k = 2 / extent is a ball that just fits in
/// @pre the image has the layers of a picture
[[nodiscard]] std::vector<std::uint8_t> layerColours(const render::Image& image, Layer layer,
                                                     double extent, double range = 40);

}  // namespace viewer
