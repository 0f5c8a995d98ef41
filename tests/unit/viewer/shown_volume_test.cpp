// Volumes in the viewer: isosurfaces, slices, picked points and files.

#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "apps/viewer/interaction/pick.h"
#include "apps/viewer/interaction/progressive_picture.h"
#include "apps/viewer/model/model.h"
#include "apps/viewer/viewer_arguments.h"
#include "apps/viewer/volume/volume_slices.h"
#include "levelset/error.h"
#include "render/cpu/cpu_renderer.h"
#include "tests/support/files.h"
#include "tests/support/volumes.h"

namespace shown_volume_test {

using namespace viewer;
using Imath::V3d;

/// A linear function of the world position.
double ramp(const V3d& p) {
  return 3 + p.x - 2 * p.y + 0.5 * p.z;
}

/// Anisotropic grid with sheared axes, and a corner away from the origin.
levelset::VolumeGrid shearedGrid() {
  levelset::VolumeGrid grid;
  grid.size = {9, 7, 5};
  grid.indexToWorld =
      Imath::M44d(0.2, 0.02, 0, 0, 0.05, 0.3, 0.01, 0, -0.04, 0, 0.5, 0, -1, -1.2, -0.8, 1);
  return grid;
}

render::Camera cameraFrom(const V3d& from) {
  render::Camera camera;
  camera.from = from;
  camera.to = {-0.1, -0.2, 0.1};
  camera.up = {0, 0, 1};
  camera.width = 64;
  camera.height = 48;
  return camera;
}

double ballValue(const V3d& p) {
  return 10 - 10 * p.length();
}

std::shared_ptr<const Model> ballModel() {
  auto model = std::make_shared<Model>();
  model->volume = std::make_shared<const ShownVolume>(
      shownVolume(support::sampled(support::cubeGrid(24), ballValue)));
  model->scene.solids.push_back(
      {.band = {},
       .name = "ball",
       .volume = std::make_shared<const render::VolumeSurface>(model->volume->surface)});
  model->solidBounds = model->bounds = model->scene.volumeBounds();
  return model;
}

std::shared_ptr<const Frame> finished(const ProgressivePicture& picture, const View& view,
                                      const Display& display) {
  for (;;) {
    if (picture.failure()) std::rethrow_exception(picture.failure());
    std::shared_ptr<const Frame> frame = picture.frame();
    if (frame && frame->isComplete && isSame(frame->view, view) && frame->display == display)
      return frame;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

TEST(ShownVolume, SlicesShowTheInterpolantOnTheirPlanes) {
  const levelset::Volume volume = support::sampled(shearedGrid(), ramp);
  const Imath::M44d toIndex = volume.grid().indexToWorld.inverse();
  SliceView slices;
  slices.at = {2.5, 4.0, 1.25};
  for (const V3d& from : {V3d(4, 3, 2), V3d(-4, 2, -1), V3d(0.3, -5, 0.2)}) {
    const render::Camera camera = cameraFrom(from);
    std::array<int, 3> seen = {};
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const auto point = sliceAt(volume, slices, camera, x + 0.5, y + 0.5);
        if (!point) continue;
        ++seen[point->axis];
        const V3d index = point->position * toIndex;
        EXPECT_NEAR(index[static_cast<int>(point->axis)], *slices.at[point->axis], 1e-12);
        EXPECT_NEAR(point->value, ramp(point->position), 1e-6);
        EXPECT_NEAR((point->position - camera.from).dot(camera.axis()), point->depth, 1e-12);
        // No other slice lies in front.
        for (std::size_t other = 0; other < 3; ++other) {
          SliceView alone;
          alone.at[other] = slices.at[other];
          const auto behind = sliceAt(volume, alone, camera, x + 0.5, y + 0.5);
          EXPECT_TRUE(!behind || behind->depth >= point->depth);
        }
      }
    for (const int pixels : seen) EXPECT_GT(pixels, 20);
  }
  const V3d normal = sliceNormal(volume, 1);
  EXPECT_NEAR(normal.length(), 1, 1e-15);
  EXPECT_NEAR(normal.dot(V3d(0.2, 0.02, 0)), 0, 1e-15);
  EXPECT_NEAR(normal.dot(V3d(-0.04, 0, 0.5)), 0, 1e-15);
  EXPECT_GT(normal.y, 0);
}

TEST(ShownVolume, SlicesEndAtTheGridAndAtTheClipDepths) {
  const levelset::Volume volume = support::sampled(support::cubeGrid(8), ramp);
  SliceView slices;
  slices.at = {std::nullopt, std::nullopt, 4.0};  // the plane z = 0
  render::Camera camera;
  camera.from = {0, 0, 5};
  camera.to = {0, 0, 0};
  camera.width = camera.height = 100;
  camera.orthoHeight = 4;
  const auto at = [&](double x, double y) { return sliceAt(volume, slices, camera, x, y); };
  // The grid spans −1.3 … 1.3, a pixel 0.04.
  EXPECT_TRUE(at(50 + 32.4, 50));
  EXPECT_FALSE(at(50 + 32.6, 50));
  EXPECT_TRUE(at(50, 50 - 32.4));
  EXPECT_FALSE(at(50, 50 - 32.6));
  camera.near = 5.1;
  EXPECT_FALSE(at(50, 50));
  camera.near = 0;
  camera.far = 4.9;
  EXPECT_FALSE(at(50, 50));
  camera.far.reset();
  slices.at = {4.0, std::nullopt, std::nullopt};  // parallel to the rays
  EXPECT_FALSE(at(50, 50));
}

TEST(ShownVolume, SurfacesHideSlicesAsFarAsTheyAreOpaque) {
  const levelset::Volume volume =
      support::sampled(support::cubeGrid(8), [](const V3d&) { return 5; });
  SliceView slices{.at = {std::nullopt, std::nullopt, 4.0}, .black = 0, .white = 10};
  render::Camera camera;
  camera.from = {0, 0, 5};
  camera.to = {0, 0, 0};
  camera.width = 4;
  camera.height = 1;
  camera.orthoHeight = 0.5;
  render::Image picture(4, 1);
  picture.channels["Z"] = {INFINITY, 4, 4, 6};
  std::vector<std::uint8_t> colours = {0,   0,   0,  0,  200, 100, 50, 255,
                                       200, 100, 50, 51, 200, 100, 50, 255};
  paintSlices(volume, slices, camera, picture, colours);
  const std::vector<std::uint8_t> expected = {
      128, 128, 128, 255,  // nothing else: grey of the middle between black and white
      200, 100, 50,  255,  // an opaque surface in front
      142, 122, 112, 255,  // a surface of opacity 0.2 in front
      128, 128, 128, 255,  // a surface behind
  };
  EXPECT_EQ(colours, expected);
}

TEST(ShownVolume, BeginsWithASuggestedIsovalueAndGreysOfAlmostAllValues) {
  const auto volume = shownVolume(support::sampled(support::cubeGrid(24), [](const V3d& p) {
    return p.length() < 0.3 ? 1000.0 : p.length() < 1 ? 50.0 + 10 * p.x : 0.0;
  }));
  const IsosurfaceView first = firstIsosurface(volume);
  EXPECT_TRUE(first.isShown);
  EXPECT_GT(first.isovalue, 0);
  EXPECT_LT(first.isovalue, 1000);
  const SliceView slices = firstSlices(volume);
  EXPECT_TRUE(slices.isEmpty());
  EXPECT_NEAR(slices.black, 0, 5);
  EXPECT_GT(slices.white, 40);
  EXPECT_LT(slices.white, 1001);

  // Equal values: no isovalue is in between, but a view exists.
  const auto constant =
      shownVolume(support::sampled(support::cubeGrid(4), [](const V3d&) { return 7; }));
  EXPECT_TRUE(std::isfinite(firstIsosurface(constant).isovalue));
  EXPECT_LE(firstSlices(constant).black, firstSlices(constant).white);
}

TEST(ShownVolume, DrawsTheIsosurfaceThatTheRendererDraws) {
  const auto model = ballModel();
  View view{model, cameraFrom({3, 2, 1}), std::nullopt};
  ProgressivePicture picture(Renderer::Cpu);
  const Display display;
  for (const auto& [isovalue, filter] :
       {std::pair(2.0, render::Filter::Trilinear), {4.0, render::Filter::CubicC1}}) {
    view.isosurface = {.isovalue = isovalue, .filter = filter};
    picture.request(view, display);
    const auto frame = finished(picture, view, display);
    render::Scene scene = model->scene;
    placeIsosurface(*model->volume, view.isosurface, scene);
    scene.camera = view.camera;
    render::RenderOptions options;
    options.filter = filter;
    const render::Image drawn = render::renderCpu(scene, options);
    EXPECT_EQ(frame->image->channels.at("Z"), drawn.channels.at("Z"));
    EXPECT_EQ(frame->image->channels.at("R"), drawn.channels.at("R"));
  }
  view.isosurface.isShown = false;
  picture.request(view, display);
  for (const float depth : finished(picture, view, display)->image->channels.at("Z"))
    EXPECT_FALSE(std::isfinite(depth));
}

TEST(ShownVolume, DrawsTheLightOfTheVolume) {
  const auto model = ballModel();
  View view{model, cameraFrom({3, 2, 1}), std::nullopt};
  view.isosurface = {.isovalue = 6};
  view.opacity = 0.5;  // without effect
  ProgressivePicture picture(Renderer::Cpu);
  const Display display;
  for (const double opacity : {0.01, 0.1}) {
    view.light.transfer = {{0, 0}, {5, opacity, Imath::C3f(1, 0.2f, 0)}};
    picture.request(view, display);
    const auto frame = finished(picture, view, display);
    render::Scene scene = model->scene;
    placeIsosurface(*model->volume, view.isosurface, scene);
    scene.camera = view.camera;
    scene.volumePart = {directVolume(*model->volume, view.light)};
    const render::Image drawn = render::renderCpu(scene);
    EXPECT_EQ(frame->image->channels.at("R"), drawn.channels.at("R"));
    EXPECT_EQ(frame->image->channels.at("A"), drawn.channels.at("A"));
  }
}

TEST(ShownVolume, DrawsTheVolumeOfASceneFile) {
  const support::TemporaryFolder folder;
  std::ofstream(folder / "ramp.mha")
      << "ObjectType = Image\nNDims = 3\nBinaryData = False\nDimSize = 2 2 2\n"
         "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n1 2 3 4 5 6 7 8\n";
  std::ofstream(folder / "scene.json") << R"({"format": "levelsmith scene", "version": 1,
             "volumes": [{"name": "ramp", "file": "ramp.mha", "transfer": "0:0 8:0.4/1,0.5,0"}]})";
  const auto model = std::make_shared<const Model>(openModel({folder / "scene.json"}));
  EXPECT_EQ(model->bounds.size(), V3d(1));
  EXPECT_EQ(model->description, "1 volume");
  const View view{model, render::framingCamera(model->bounds, 48, 36), std::nullopt};
  const Display display;
  ProgressivePicture picture(Renderer::Cpu);
  picture.request(view, display);
  const auto frame = finished(picture, view, display);
  render::Scene scene = model->scene;
  scene.camera = view.camera;
  const render::Image drawn = render::renderCpu(scene);
  EXPECT_EQ(frame->image->channels.at("R"), drawn.channels.at("R"));
  EXPECT_GT(drawn.channels.at("R")[18 * 48 + 24], 0.1f);
}

TEST(ShownVolume, PicksPointsOfTheSurfaceAndOfSlices) {
  const auto model = ballModel();
  View view{model, cameraFrom({9, 0, 0}), std::nullopt};
  view.camera.to = V3d(0);
  view.isosurface = {.isovalue = 5, .filter = render::Filter::BSplineQi};
  Display display;
  ProgressivePicture picture(Renderer::Cpu);
  picture.request(view, display);
  const auto surface = pick(*finished(picture, view, display), 32, 24);
  ASSERT_TRUE(surface);
  EXPECT_NEAR(surface->position.length(), 0.5, 0.01);
  EXPECT_NEAR(surface->normal.dot(surface->position.normalized()), 1, 1e-3);
  EXPECT_NEAR(*surface->value, 5, 0.1);
  EXPECT_NE(pickedJson(surface).find("\"phi\":null"), std::string::npos) << pickedJson(surface);

  display.slices.at[0] = 20;  // in front of the ball
  picture.request(view, display);
  const auto frame = finished(picture, view, display);
  const auto slice = pick(*frame, 32, 24);
  ASSERT_TRUE(slice);
  EXPECT_NEAR(slice->position.x, -1.3 + 20 * 2.6 / 24, 1e-12);
  EXPECT_EQ(slice->normal, V3d(1, 0, 0));
  EXPECT_NEAR(*slice->value, ballValue(slice->position), 0.1);
  EXPECT_NEAR(*depthSeen(*frame, 32.5, 24.5), 9 - slice->position.x, 1e-12);
  EXPECT_FALSE(pick(*frame, 0, 0));
}

TEST(ShownVolume, OpensGridsOfNumbersThatAreNoLevelSets) {
  const support::TemporaryFolder folder;
  const auto grid = openvdb::FloatGrid::create(0);
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j)
      for (int k = 0; k < 8; ++k) grid->tree().setValue({i, j, k}, static_cast<float>(i));
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setName("density");
  openvdb::io::File file((folder / "fog.vdb").string());
  file.write({grid});
  file.close();
  const Model model = openModel({folder / "fog.vdb"});
  ASSERT_TRUE(model.volume);
  EXPECT_EQ(model.volume->surface.volume().highest(), 7);
  EXPECT_FALSE(model.canCut());
  EXPECT_NE(model.description.find("volume of 10 x 10 x 10"), std::string::npos)
      << model.description;
  EXPECT_TRUE(canOpen("head.nii.gz"));
  EXPECT_FALSE(canOpen("head.raw"));
}

TEST(ShownVolume, SurvivesFilesThatShrink) {
  const support::TemporaryFolder folder;
  const auto file = folder / "steps.mha";
  {
    std::ofstream stream(file, std::ios::binary);
    stream << "ObjectType = Image\nNDims = 3\nDimSize = 16 16 64\nElementType = MET_UCHAR\n"
              "BinaryData = True\nBinaryDataByteOrderMSB = False\nElementDataFile = LOCAL\n";
    for (int n = 0; n < 16 * 16 * 64; ++n) stream.put(static_cast<char>(n / 256));
  }
  const Model model = openModel({file});
  ASSERT_TRUE(model.volume);
  std::filesystem::resize_file(file, 0);
  const levelset::Volume& volume = model.volume->surface.volume();
  EXPECT_FALSE(volume.isMapped());
  EXPECT_EQ(volume.at(15, 15, 63), 63);
}

TEST(ShownVolume, ParsesSlicesAndWritesTheOperator) {
  const auto slices = parseSlices("k=60.5,i=3");
  EXPECT_EQ(slices[0], 3.0);
  EXPECT_FALSE(slices[1]);
  EXPECT_EQ(slices[2], 60.5);
  for (const char* text : {"", "i", "i=", "l=3", "i=3,i=4", "i=3,", "i=x", "ij=3"})
    EXPECT_THROW((void)parseSlices(text), levelset::UsageError) << text;
  EXPECT_EQ(isosurfaceText({.isovalue = 40}), "isosurface 40");
  EXPECT_EQ(isosurfaceText({.isovalue = -0.25,
                            .inside = render::VolumeInside::Below,
                            .filter = render::Filter::CubicC1}),
            "isosurface -0.25 --filter cubic-c1 --inside below");
  const LightView light{.transfer = {{1, 0}, {2, 0.5}}, .isShaded = false};
  EXPECT_EQ(lightText(light, {.isShown = false}), "--transfer \"1:0 2:0.5\" --no-shading");
  EXPECT_EQ(lightText({.transfer = {{1, 0.5}}}, {.isovalue = 3}),
            "--transfer \"1:0.5\" --isovalue 3");
}

}  // namespace shown_volume_test
