#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "render/images/image.h"

namespace viewer {

/// Layer of the picture that the viewer displays.
enum class Layer {
  Colour,
  Normal,
  Depth,
  Position,
  MeanCurvature,
  GaussCurvature,
  K1,
  K2,
  Id,
  Thickness  ///< length of the view ray inside the solids
};

inline constexpr std::array<Layer, 10> kLayers = {
    Layer::Colour,         Layer::Normal, Layer::Depth, Layer::Position, Layer::MeanCurvature,
    Layer::GaussCurvature, Layer::K1,     Layer::K2,    Layer::Id,       Layer::Thickness};

/// Name of a layer in options and menus: "colour", "normal", …
[[nodiscard]] const char* layerName(Layer layer);
/// Finds the layer with a name. @throws levelset::UsageError for an unknown name; the message lists
/// the names
[[nodiscard]] Layer layerNamed(const std::string& name);

/// Red, green and blue of a displayed colour (sRGB), from 0 to 1.
using DisplayColour = std::array<double, 3>;

/// Colour for a value: blue at −1, white at 0, red at 1. Values outside this range are clamped.
[[nodiscard]] DisplayColour divergingColour(double value);
/// Colour for a solid's or mesh's id, different for each id; grey for 0.
[[nodiscard]] DisplayColour idColour(std::uint32_t id);

/// Converts a layer of a picture to four bytes for each pixel: red, green, blue, alpha. Pixels
/// without a hit are transparent.
/// - Colour: the pixels of a PNG of the picture.
/// - Normals: x, y, z from −1 to 1 as red, green, blue.
/// - Depth: white for the nearest point of the picture, dark for the farthest.
/// - Positions: x, y, z as red, green, blue, scaled to the bounding box of the points in the
/// picture.
/// - Curvatures: the colour scale spans curvature × extent from −range to range (Gauss curvature ×
/// extent² from −range² to range²).
/// - Thickness: the sum of the lengths of all parts of the view ray that lie inside the solids,
/// from pale yellow for 0 to dark violet for the largest of the picture.
/// @param extent  diagonal of the bounding box of the surfaces, world units
/// @param range  product of curvature and extent at the ends of the colour scale
/// @pre the image has the layers that renderEmbree() returns, and for Thickness the layer thickness
[[nodiscard]] std::vector<std::uint8_t> layerColours(const render::Image& image, Layer layer,
                                                     double extent, double range = 40);

}  // namespace viewer
