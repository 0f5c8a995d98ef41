#include "apps/viewer/model/layer_colours.h"

#include <gtest/gtest.h>

#include <cmath>

#include <limits>
#include <set>

#include "levelset/error.h"

namespace layer_colours_test {

using namespace viewer;
using Bytes = std::vector<std::uint8_t>;

/// Three pixels: two hits and the background.
render::Image threePixels() {
  render::Image image(3, 1);
  for (const char* name :
       {"R", "G", "B", "A", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "thickness"})
    image.addChannel(name);
  for (const char* name : {"mean", "gauss", "k1", "k2"})
    image.addChannel(std::string("curvature.") + name);
  image.addChannel("Z", std::numeric_limits<float>::infinity());
  image.channels["Z"] = {2, 4, std::numeric_limits<float>::infinity()};
  image.channels["N.X"] = {0, 1, 0};
  image.channels["N.Z"] = {1, 0, 0};
  image.channels["P.X"] = {-1, 3, 0};
  image.ids["id"] = {1, 2, 0};
  return image;
}

Bytes pixel(const Bytes& all, std::size_t i) {
  return {all.begin() + static_cast<std::ptrdiff_t>(4 * i),
          all.begin() + static_cast<std::ptrdiff_t>(4 * i + 4)};
}

TEST(LayerColours, ShowNormalsByComponent) {
  const Bytes bytes = layerColours(threePixels(), Layer::Normal, 1);
  EXPECT_EQ(pixel(bytes, 0), (Bytes{128, 128, 255, 255}));
  EXPECT_EQ(pixel(bytes, 1), (Bytes{255, 128, 128, 255}));
  EXPECT_EQ(pixel(bytes, 2), (Bytes{0, 0, 0, 0}));
}

TEST(LayerColours, ShowDepthsFromWhiteToDark) {
  const Bytes bytes = layerColours(threePixels(), Layer::Depth, 1);
  EXPECT_EQ(pixel(bytes, 0), (Bytes{255, 255, 255, 255}));
  EXPECT_EQ(pixel(bytes, 1), (Bytes{38, 38, 38, 255}));
  EXPECT_EQ(pixel(bytes, 2)[3], 0);
}

TEST(LayerColours, ShowPositionsWithinTheVisibleBounds) {
  const Bytes bytes = layerColours(threePixels(), Layer::Position, 1);
  EXPECT_EQ(pixel(bytes, 0), (Bytes{0, 128, 128, 255}));
  EXPECT_EQ(pixel(bytes, 1), (Bytes{255, 128, 128, 255}));
}

TEST(LayerColours, ScaleCurvaturesByTheExtent) {
  render::Image image = threePixels();
  image.channels["curvature.mean"] = {20, -20, 0};
  image.channels["curvature.gauss"] = {400, 0, 0};
  // The same solid ten times as large has the same colours.
  render::Image large = image;
  large.channels["curvature.mean"] = {2, -2, 0};
  large.channels["curvature.gauss"] = {4, 0, 0};
  for (const Layer layer : {Layer::MeanCurvature, Layer::GaussCurvature})
    EXPECT_EQ(layerColours(image, layer, 2), layerColours(large, layer, 20));
  const Bytes bytes = layerColours(image, Layer::MeanCurvature, 2, 40);
  const DisplayColour red = divergingColour(1), blue = divergingColour(-1);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(pixel(bytes, 0)[c], std::lround(255 * red[c]));
    EXPECT_EQ(pixel(bytes, 1)[c], std::lround(255 * blue[c]));
  }
}

TEST(LayerColours, DivergeFromWhiteAndAreClamped) {
  const DisplayColour middle = divergingColour(0);
  for (const double c : middle) EXPECT_GT(c, 0.9);
  EXPECT_GT(divergingColour(0.5)[0], divergingColour(0.5)[2]);
  EXPECT_LT(divergingColour(-0.5)[0], divergingColour(-0.5)[2]);
  EXPECT_EQ(divergingColour(7), divergingColour(1));
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(divergingColour(-infinite), divergingColour(-1));
  EXPECT_EQ(divergingColour(std::numeric_limits<double>::quiet_NaN()), middle);
}

TEST(LayerColours, GiveEachSolidAColourOfItsOwn) {
  std::set<DisplayColour> colours;
  for (std::uint32_t id = 0; id < 200; ++id) colours.insert(idColour(id));
  EXPECT_EQ(colours.size(), 200u);
  const Bytes bytes = layerColours(threePixels(), Layer::Id, 1);
  EXPECT_NE(pixel(bytes, 0), pixel(bytes, 1));
  EXPECT_EQ(pixel(bytes, 2)[3], 0);
}

TEST(LayerColours, HaveNamesThatCanBeParsed) {
  for (const Layer layer : kLayers) EXPECT_EQ(layerNamed(layerName(layer)), layer);
  EXPECT_THROW((void)layerNamed("colours"), levelset::UsageError);
  EXPECT_THROW((void)layerNamed(""), levelset::UsageError);
}

TEST(LayerColours, OfAnEmptyImageAreEmpty) {
  render::Image image = threePixels();
  image.channels["Z"].assign(3, std::numeric_limits<float>::infinity());
  for (const Layer layer : kLayers)
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_EQ(pixel(layerColours(image, layer, 0), i)[3], 0) << layerName(layer);
}

}  // namespace layer_colours_test
