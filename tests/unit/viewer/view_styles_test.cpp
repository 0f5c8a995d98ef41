// Transparency, matcap and thickness in the viewer's pictures.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "apps/viewer/interaction/progressive_picture.h"
#include "apps/viewer/model/matcap_ball.h"
#include "levelset/csg/csg.h"
#include "levelset/shapes/shapes.h"

namespace view_styles_test {

using namespace viewer;
using Imath::V3d;

std::shared_ptr<Model> modelWith(const levelset::NarrowBand& band) {
  auto model = std::make_shared<Model>();
  model->scene.solids.push_back({.band = band, .name = "solid"});
  model->solidBounds = model->bounds = band.zeroSetBounds();
  return model;
}

/// Orthographic view along −z: a pixel is a tenth of a world unit wide.
View viewOf(const std::shared_ptr<const Model>& model) {
  View view{model, {}, std::nullopt};
  view.camera.from = {0, 0, 10};
  view.camera.width = 31;
  view.camera.height = 31;
  view.camera.orthoHeight = 3.1;
  return view;
}

std::shared_ptr<const Frame> drawn(const View& view, const Display& display) {
  ProgressivePicture picture(Renderer::Cpu);
  EXPECT_FALSE(picture.isBusy());
  picture.request(view, display);
  while (picture.isBusy()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  if (picture.failure()) std::rethrow_exception(picture.failure());
  return picture.frame();
}

std::size_t pixel(int x, int y) {
  return static_cast<std::size_t>(31 * y + x);
}

TEST(ViewStyles, ThicknessIsTheLengthOfTheRayInsideTheSolids) {
  // Two balls one behind the other: the lengths of both parts add up.
  const auto model = modelWith(levelset::unite(levelset::makeSphere(1, V3d(0), 0.05),
                                               levelset::makeSphere(0.5, V3d(0, 0, -3), 0.05)));
  View view = viewOf(model);
  view.hasThickness = true;
  const auto frame = drawn(view, {.layer = Layer::Thickness});
  const std::vector<float>& thickness = frame->image->channels.at("thickness");
  double worst = 0;
  for (const int away : {0, 2, 4, 7, 9}) {
    const double x = 0.1 * away;
    const double truth = 2 * std::sqrt(1 - x * x) + (x < 0.5 ? 2 * std::sqrt(0.25 - x * x) : 0.0);
    worst = std::max(worst, std::abs(static_cast<double>(thickness[pixel(15 + away, 15)]) - truth));
  }
  EXPECT_LT(worst, 5e-3);
  EXPECT_EQ(thickness[pixel(0, 0)], 0);
  // The colour is darkest where the solids are thickest, and absent beside them.
  const auto sum = [&](int x, int y) {
    const std::uint8_t* p = frame->canvas.colours.data() + 4 * pixel(x, y);
    return p[0] + p[1] + p[2];
  };
  EXPECT_LT(sum(15, 15), sum(20, 15));
  EXPECT_LT(sum(20, 15), sum(24, 15));
  EXPECT_EQ(frame->canvas.colours[4 * pixel(0, 0) + 3], 0);
}

TEST(ViewStyles, OpacityCountsForEachCrossing) {
  const auto model = modelWith(levelset::makeSphere(1, V3d(0), 0.05));
  for (const double opacity : {1.0, 0.5, 0.2}) {
    View view = viewOf(model);
    view.opacity = opacity;
    const auto frame = drawn(view, {});
    const double alpha = 1 - (1 - opacity) * (1 - opacity);
    EXPECT_NEAR(frame->canvas.colours[4 * pixel(15, 15) + 3], 255 * alpha, 0.51) << opacity;
  }
  // The model's own opacity is multiplied; the model stays as it is.
  model->scene.solids[0].opacity = 0.5;
  View view = viewOf(model);
  view.opacity = 0.4;
  EXPECT_NEAR(drawn(view, {})->canvas.colours[4 * pixel(15, 15) + 3], 255 * 0.36, 0.51);
  EXPECT_EQ(model->scene.solids[0].opacity, 0.5);
}

TEST(ViewStyles, KeepsTheClipPlaneOpaque) {
  const auto model = modelWith(levelset::makeSphere(1, V3d(0), 0.05));
  View view = viewOf(model);
  view.opacity = 0.2;
  view.clip = ClipPlane{.across = ClipPlane::Across::Z, .offset = 0.3};
  EXPECT_EQ(drawn(view, {})->canvas.colours[4 * pixel(15, 15) + 3], 255);
}

TEST(ViewStyles, MatcapTakesItsColourFromTheNormal) {
  View view = viewOf(modelWith(levelset::makeSphere(1, V3d(0), 0.05)));
  view.style = render::Style::Matcap;
  auto halves = std::make_shared<render::ColourImage>();
  halves->width = halves->height = 2;
  halves->pixels = {{1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 1, 0}};  // left red, right green
  view.matcap = halves;
  const auto frame = drawn(view, {});
  const auto at = [&](int x) { return frame->canvas.colours.data() + 4 * pixel(x, 15); };
  EXPECT_GT(at(7)[0], 200);
  EXPECT_LT(at(7)[1], 100);
  EXPECT_LT(at(23)[0], 100);
  EXPECT_GT(at(23)[1], 200);
  // Without a picture of the user's, the viewer's own ball: lit from the upper left.
  view.matcap = nullptr;
  const auto own = drawn(view, {});
  const auto sum = [&](int x, int y) {
    const std::uint8_t* p = own->canvas.colours.data() + 4 * pixel(x, y);
    return p[0] + p[1] + p[2];
  };
  EXPECT_GT(sum(11, 9), sum(21, 15));
  const auto ball = matcapBall();
  for (const Imath::C3f& colour : ball->pixels)
    for (int c = 0; c < 3; ++c) ASSERT_TRUE(colour[c] >= 0 && colour[c] <= 1);
}

}  // namespace view_styles_test
