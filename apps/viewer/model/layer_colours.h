#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "render/images/image.h"

namespace viewer {

/// Layer of a picture that is displayed.
enum class Layer { Colour, Normal, Depth, Position, MeanCurvature, GaussCurvature, K1, K2, Id };

inline constexpr std::array<Layer, 9> kLayers = {
    Layer::Colour,         Layer::Normal, Layer::Depth, Layer::Position, Layer::MeanCurvature,
    Layer::GaussCurvature, Layer::K1,     Layer::K2,    Layer::Id};

/// Name in options and menus: "colour", "normal", …
[[nodiscard]] const char* layerName(Layer layer);
/// Layer with a name. @throws levelset::UsageError for an unknown name; the message lists the names
[[nodiscard]] Layer layerNamed(const std::string& name);

/// Displayed red, green and blue, from 0 to 1.
using DisplayColour = std::array<double, 3>;

/// Colour for a value from −1 to 1: blue, white, red. Values outside are clamped.
[[nodiscard]] DisplayColour divergingColour(double value);
/// A different colour for each number; 0 is grey.
[[nodiscard]] DisplayColour idColour(std::uint32_t id);

/// Converts a layer to four bytes for each pixel: red, green, blue, alpha. Pixels without a hit are
/// transparent.
/// - Colour: as in the PNG of the picture.
/// - Normals: x, y, z from −1 to 1 as red, green, blue.
/// - Depth: white for the nearest point of the picture, dark for the farthest.
/// - Positions: x, y, z as red, green, blue, within the bounding box of the picture's points.
/// - Curvatures: times the extent (Gauss: times its square), from −range to range.
/// @param extent  diagonal of the surfaces' box, world units
/// @param range  largest displayed curvature times extent; a ball that just fits has k = 2 / extent
/// @pre the image has the layers of a picture
[[nodiscard]] std::vector<std::uint8_t> layerColours(const render::Image& image, Layer layer,
                                                     double extent, double range = 40);

}  // namespace viewer
