// Parts of the viewer beside surfaces: clip planes, patches, points, and input files.

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <thread>

#include "apps/viewer/interaction/clip_plane.h"
#include "apps/viewer/interaction/patch_overlay.h"
#include "apps/viewer/interaction/pick.h"
#include "apps/viewer/interaction/progressive_picture.h"
#include "apps/viewer/model/file_watch.h"
#include "apps/viewer/model/model.h"
#include "apps/viewer/viewer_arguments.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/files.h"

namespace view_parts_test {

using namespace viewer;
using Imath::V3d;

constexpr double kVoxel = 0.05;

std::shared_ptr<const Model> ballModel() {
  auto model = std::make_shared<Model>();
  model->scene.solids.push_back(
      {.band = levelset::makeSphere(1, {0, 0, 0}, kVoxel), .name = "ball"});
  model->solidBounds = model->bounds = model->scene.solids[0].band.zeroSetBounds();
  return model;
}

View ballView(const std::shared_ptr<const Model>& model) {
  View view{model, {}, std::nullopt};
  view.camera.from = {0, 0, 5};
  view.camera.width = 64;
  view.camera.height = 48;
  return view;
}

/// Waits for a condition. One that never holds runs into the time limit of the test.
void waitFor(const std::function<bool()>& condition) {
  while (!condition()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

/// Waits for the complete frame of a view.
std::shared_ptr<const Frame> finished(const ProgressivePicture& picture, const View& view) {
  std::shared_ptr<const Frame> frame;
  waitFor([&] {
    frame = picture.frame();
    if (frame && frame->isComplete && isSame(frame->view, view)) return true;
    if (picture.failure()) std::rethrow_exception(picture.failure());
    return false;
  });
  return frame;
}

TEST(ProgressivePicture, CompletesTheLastRequest) {
  ProgressivePicture picture(Renderer::Cpu);
  const auto model = ballModel();
  View view = ballView(model);
  for (int i = 0; i < 20; ++i) {
    view.camera.from.x = 0.1 * i;
    picture.request(view, {});
  }
  const auto frame = finished(picture, view);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->pixelSize, 1);
  EXPECT_EQ(frame->canvas.width, 64);
}

TEST(ProgressivePicture, ShowsAnotherLayerOfTheSamePicture) {
  ProgressivePicture picture(Renderer::Cpu);
  const View view = ballView(ballModel());
  picture.request(view, {});
  const auto first = finished(picture, view);
  ASSERT_NE(first, nullptr);
  picture.request(view, {.layer = Layer::Normal});
  std::shared_ptr<const Frame> second;
  waitFor([&] {
    second = picture.frame();
    return second && second != first;
  });
  EXPECT_EQ(second->image, first->image);
  const std::size_t middle = 4 * (24 * 64 + 32);
  EXPECT_NEAR(second->canvas.colours[middle + 2], 255, 2);
}

TEST(ProgressivePicture, ReportsWhyAViewCannotBeDrawnAndContinues) {
  ProgressivePicture picture(Renderer::Cpu);
  const auto model = ballModel();
  View view = ballView(model), blind = view;
  blind.camera.from = blind.camera.to;
  picture.request(blind, {});
  waitFor([&] { return picture.failure() != nullptr; });
  ASSERT_TRUE(picture.failure());
  EXPECT_THROW(std::rethrow_exception(picture.failure()), levelset::UsageError);
  picture.request(view, {});
  EXPECT_NE(finished(picture, view), nullptr);
}

TEST(ProgressivePicture, DrawsPicturesOfOnePixelAndEmptyPictures) {
  ProgressivePicture picture(Renderer::Cpu);
  View view = ballView(ballModel());
  view.camera.width = view.camera.height = 1;
  picture.request(view, {});
  EXPECT_NE(finished(picture, view), nullptr);
  view = ballView(std::make_shared<Model>());
  picture.request(view, {});
  const auto frame = finished(picture, view);
  ASSERT_NE(frame, nullptr);
  EXPECT_FALSE(pick(*frame, 32, 24).has_value());
}

TEST(ClipPlane, ShowsThePlaneAndTheDistanceInIt) {
  ProgressivePicture picture(Renderer::Cpu);
  View view = ballView(ballModel());
  for (const auto across : {ClipPlane::Across::Z, ClipPlane::Across::View}) {
    view.clip = ClipPlane{across, 0.25};
    picture.request(view, {});
    const auto frame = finished(picture, view);
    ASSERT_NE(frame, nullptr);
    for (const int x : {32, 38}) {  // inside the section of the ball
      const auto picked = pick(*frame, x, 24);
      ASSERT_TRUE(picked);
      EXPECT_NEAR(picked->position.z, 0.25, 1e-5);
      EXPECT_NEAR(picked->normal.z, 1, 1e-5);
      EXPECT_EQ(picked->solid, "ball");
      EXPECT_NEAR(picked->phi, std::max(picked->position.length() - 1, -3 * kVoxel), 0.1 * kVoxel);
      const std::size_t i = 4 * static_cast<std::size_t>(24 * 64 + x);
      EXPECT_GT(frame->canvas.colours[i + 2], frame->canvas.colours[i]);  // blue inside
    }
  }
}

TEST(ClipPlane, FacesTheEyeFromAnySide) {
  const Imath::Box3d bounds(V3d(-1), V3d(1));
  render::Camera camera;
  for (const double side : {-5.0, 5.0}) {
    camera.from = {side, 0.5, 0};
    const PlacedPlane plane = placed({ClipPlane::Across::X, 0.25}, camera, bounds);
    EXPECT_EQ(plane.point.x, 0.25);
    EXPECT_EQ(plane.normal.x, side < 0 ? -1 : 1);
  }
  camera.from = {1, 2, 3};
  const PlacedPlane plane = placed({ClipPlane::Across::View, 0.5}, camera, bounds);
  EXPECT_NEAR((plane.point - plane.normal * 0.5).length(), 0, 1e-15);
  EXPECT_NEAR(plane.normal.dot(camera.axis()), -1, 1e-15);
}

TEST(ClipPlane, CutsTheResultOfAnExpression) {
  render::Scene scene;
  scene.solids.push_back({.band = levelset::makeSphere(1, {0, 0, 0}, kVoxel), .name = "a"});
  scene.solids.push_back({.band = levelset::makeSphere(1, {0.5, 0, 0}, kVoxel), .name = "b"});
  scene.csg = render::CsgExpression("a - b", {"a", "b"});
  EXPECT_NEAR(scenePhi(scene, {-0.1, 0.05}), -0.05, 1e-15);
  EXPECT_NEAR(scenePhi(scene, {-0.1, -0.2}), 0.2, 1e-15);
  ClippedScene cut(scene, Imath::Box3d(V3d(-1), V3d(1.5, 1, 1)), ClipPlane::Across::Y);
  const render::Scene& result = cut.at({{0, 0.5, 0}, {0, 1, 0}});
  ASSERT_EQ(result.solids.size(), 3u);
  const char kept[3] = {1, 0, 0}, taken[3] = {1, 0, 1};
  EXPECT_TRUE(result.csg.holds(kept));
  EXPECT_FALSE(result.csg.holds(taken));
}

TEST(ClipPlane, IsReadFromText) {
  EXPECT_EQ(parseClipPlane("y=-0.5"), (ClipPlane{ClipPlane::Across::Y, -0.5}));
  EXPECT_EQ(parseClipPlane("view=1e-3"), (ClipPlane{ClipPlane::Across::View, 1e-3}));
  for (const char* wrong : {"", "w=1", "x=", "x=a", "=1", "x=nan", "x==1"})
    EXPECT_THROW((void)parseClipPlane(wrong), levelset::UsageError) << wrong;
}

mapping::Patch flatPatch() {
  mapping::Patch patch;
  patch.height = 0.5;
  for (const double w : {0.0, 1.0}) {
    mapping::ParticleLayer layer;
    layer.columns = layer.rows = 3;
    layer.w = w;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        layer.positions.emplace_back(0.5 * c - 0.5, 0.5 * r - 0.5, 0.5 * w);
    patch.layers.push_back(layer);
  }
  return patch;
}

TEST(PatchOverlay, DrawsBeforeASurfaceAndFaintlyBehindIt) {
  render::Camera camera;
  camera.width = camera.height = 50;
  const auto middleAlpha = [&](float depth) {
    render::Image picture(5, 5);
    picture.addChannel("Z", depth);
    Canvas canvas{50, 50, std::vector<std::uint8_t>(4 * 50 * 50, 0)};
    drawPatches({flatPatch()}, PatchLines::Base, camera, picture, 1e-3, canvas);
    return canvas.colours[4 * (25 * 50 + 25) + 3];
  };
  EXPECT_GT(middleAlpha(std::numeric_limits<float>::infinity()), 100);
  EXPECT_GT(middleAlpha(5), 100);
  const int behind = middleAlpha(1);
  EXPECT_GT(behind, 0);
  EXPECT_LT(behind, 60);
}

TEST(PatchOverlay, HandlesPointsBehindTheEyeAndOutsideThePicture) {
  render::Image picture(1, 1);
  picture.addChannel("Z", std::numeric_limits<float>::infinity());
  mapping::Patch patch = flatPatch();
  patch.layers[1].positions[4] = {1e30, -1e30, 1e30};
  patch.layers[0].positions[4] = {0, 0, 4.999999999};
  for (const double z : {0.1, 0.25, 5.0, -1e9}) {
    render::Camera camera;
    camera.from = {0, 0.1, z};
    camera.to = {0, 0, z - 1};
    camera.width = 7;
    camera.height = 3;
    for (const bool isOrtho : {false, true}) {
      if (isOrtho) camera.orthoHeight = 1e-3;
      for (const PatchLines lines : {PatchLines::Outline, PatchLines::Base, PatchLines::All}) {
        Canvas canvas{7, 3, std::vector<std::uint8_t>(4 * 7 * 3, 0)};
        drawPatches({patch, mapping::Patch{}}, lines, camera, picture, 1e-3, canvas);
        ASSERT_EQ(canvas.colours.size(), 4u * 7 * 3);
        const bool isDrawn = std::any_of(canvas.colours.begin(), canvas.colours.end(),
                                         [](std::uint8_t value) { return value > 0; });
        EXPECT_TRUE(isDrawn || isOrtho || z != 5.0);
        EXPECT_FALSE(isDrawn && !isOrtho && z < 0) << "behind the eye";
      }
    }
  }
}

TEST(PatchOverlay, StretchesPicturesToAnySize) {
  const Canvas small{2, 1, {0, 0, 0, 255, 200, 100, 50, 255}};
  const Canvas wide = stretched(small, 4, 2);
  EXPECT_EQ(wide.colours.size(), 4u * 4 * 2);
  EXPECT_EQ(wide.colours[0], 0);
  EXPECT_EQ(wide.colours[4], 50);
  EXPECT_EQ(wide.colours[12], 200);
  EXPECT_EQ(stretched(wide, 4, 2).colours, wide.colours);
  EXPECT_EQ(stretched(wide, 1, 1).colours.size(), 4u);
}

TEST(Pick, WritesPointsAsTheCommandLineTakesThem) {
  EXPECT_EQ(pointText({0.1, -2, 1e-9}), "0.1,-2,1e-09");
  EXPECT_EQ(pointText({-0.0, 0, 12345.678}), "0,0,12345.678");
  EXPECT_EQ(pickedJson(std::nullopt), "null");
  EXPECT_EQ(pickedJson(Picked{{1, 2, 3}, {0, 0, 1}, 0.5, "a\"b"}),
            R"({"position":[1.0,2.0,3.0],"normal":[0.0,0.0,1.0],"phi":0.5,"solid":"a\"b"})");
}

TEST(FileWatch, ReportsAChangeOnceTheFileIsStable) {
  const support::TemporaryFolder folder;
  const auto file = folder.path() / "a.txt";
  std::ofstream(file) << "one";
  FileWatch watch({file});
  EXPECT_FALSE(watch.hasChanged());
  std::ofstream(file) << "longer";
  EXPECT_FALSE(watch.hasChanged());  // it may still be incomplete
  EXPECT_TRUE(watch.hasChanged());
  EXPECT_FALSE(watch.hasChanged());
  std::filesystem::remove(file);
  EXPECT_FALSE(watch.hasChanged());
  EXPECT_FALSE(watch.hasChanged());
  EXPECT_TRUE(watch.isAnyMissing());
  std::ofstream(file) << "back";
  EXPECT_FALSE(watch.hasChanged());
  EXPECT_TRUE(watch.hasChanged());
  EXPECT_FALSE(FileWatch().hasChanged());
}

TEST(OpenModel, RefusesUnsupportedFiles) {
  const support::TemporaryFolder folder;
  const auto file = [&](const char* name) { return folder.path() / name; };
  for (const char* name : {"broken.vdb", "broken.ply", "broken.json", "broken.patch", "a.txt"})
    std::ofstream(file(name)) << "no such thing";
  for (const char* name : {"broken.vdb", "broken.ply", "broken.json", "broken.patch"})
    EXPECT_THROW((void)openModel({file(name)}), levelset::InvalidInput) << name;
  EXPECT_THROW((void)openModel({file("a.txt")}), levelset::UsageError);
  EXPECT_THROW((void)openModel({""}), levelset::UsageError);
  EXPECT_THROW((void)openModel({file("missing.vdb")}), levelset::IoError);
  EXPECT_THROW((void)openModel({folder.path()}), levelset::UsageError);
  levelset::writeBand(file("ball.vdb"), levelset::makeSphere(1, {0, 0, 0}, 0.2));
  EXPECT_THROW((void)openModel({file("ball.vdb"), file("ball.vdb")}), levelset::UsageError);
  EXPECT_EQ(openModel({file("ball.vdb")}).scene.solids[0].name, "ball");
}

TEST(OpenModel, PutsPatchesOnTopAndSolidsInPosition) {
  using Files = std::vector<std::filesystem::path>;
  EXPECT_EQ(filesWith({"a.vdb"}, "p.patch"), (Files{"a.vdb", "p.patch"}));
  EXPECT_EQ(filesWith({"a.vdb", "p.patch"}, "p.patch"), (Files{"a.vdb", "p.patch"}));
  EXPECT_EQ(filesWith({"a.vdb", "p.patch"}, "b.ply"), (Files{"b.ply"}));
}

TEST(ViewerArguments, AreRefusedWithAMessage) {
  using Words = std::vector<std::string>;
  for (const Words& words : {Words{"--layer"},
                             {"--layer", "x"},
                             {"--size", "0x5"},
                             {"--size", "5"},
                             {"--frm", "1,2,3"},
                             {"--screenshot", "a.jpg", "f.vdb"},
                             {"--screenshot", "", "f.vdb"},
                             {"--interface", "f.vdb"},
                             {"--screenshot", "a.png"},
                             {"--pick", "5", "f.vdb"},
                             {"--pick", "-1,3", "f.vdb"},
                             {""},
                             {"f.vdb", "--size", "9x9", "--pick", "9,0"},
                             {"--resolution", "1"},
                             {"--fov", "180"},
                             {"--interface", "--screenshot", "a.exr", "f.vdb"},
                             {"--to", "1,2,3"},
                             {"--ortho", "0"}})
    EXPECT_THROW((void)parseArguments(words), levelset::UsageError) << words[0];
  const Arguments arguments =
      parseArguments({"a.vdb", "--layer=k1", "--clip", "x=2", "--", "--b.patch"});
  EXPECT_EQ(arguments.files.size(), 2u);
  EXPECT_EQ(arguments.display.layer, Layer::K1);
  EXPECT_EQ(arguments.clip->offset, 2);
  EXPECT_FALSE(arguments.isScript());
}

}  // namespace view_parts_test
