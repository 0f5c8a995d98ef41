// Making a patch in the viewer: rays to the surface, the editor, the text of the actions, and the
// work in the background.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>

#include "apps/pipeline/values/units.h"
#include "apps/viewer/editing/patch_editor.h"
#include "apps/viewer/editing/patch_preview.h"
#include "apps/viewer/interaction/input_script.h"
#include "apps/viewer/interaction/surface_ray.h"
#include "apps/viewer/text/point_text.h"
#include "levelset/csg/csg.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/measure.h"
#include "levelset/shapes/shapes.h"
#include "mapping/surface/geodesic.h"
#include "tests/support/files.h"

namespace patch_editor_test {

using namespace viewer;
using Imath::V2d;
using Imath::V3d;

std::shared_ptr<const Model> modelOf(const levelset::NarrowBand& band) {
  auto model = std::make_shared<Model>();
  model->scene.solids.push_back({.band = band, .name = "ball"});
  model->solidBounds = model->bounds = band.zeroSetBounds();
  return model;
}

std::shared_ptr<const Model> ball(double voxel = 0.05) {
  return modelOf(levelset::makeSphere(1, V3d(0), voxel));
}

/// A camera in front of the ball, which fills about half of its picture.
render::Camera camera() {
  render::Camera camera;
  camera.from = {0, 0, 6};
  camera.width = 400;
  camera.height = 300;
  return camera;
}

const levelset::NarrowBand& bandOf(const std::shared_ptr<const Model>& model) {
  return model->scene.solids.front().band;
}

void drag(PatchEditor& editor, const V2d& from, const V2d& to) {
  ASSERT_TRUE(editor.press(from, camera()));
  editor.moveTo(0.5 * (from + to), camera());
  editor.moveTo(to, camera());
  editor.release();
}

/// Positions in the picture of four corners in clockwise order, seen from the eye.
constexpr std::array<std::array<double, 2>, 4> kClockwise = {
    {{160, 110}, {240, 115}, {235, 190}, {165, 185}}};

void placeCorners(PatchEditor& editor) {
  for (const auto& [x, y] : kClockwise) drag(editor, V2d(x - 6, y + 4), V2d(x, y));
}

TEST(SurfaceRay, MeetsABallWhereTheRayDoes) {
  const auto model = ball(0.05);
  double worst = 0, worstNormal = 0;
  for (const V3d& side : {V3d(1, 0, 0), V3d(0, -1, 0), V3d(0.3, 0.5, -0.8), V3d(-1, 1, 1)})
    for (const double offset : {0.0, 0.3, 0.7, 0.95}) {
      const V3d toEye = side.normalized();
      const V3d across = toEye.cross(V3d(0.2, 0.9, 0.4)).normalized();
      const render::Camera::Ray ray{.origin = 5.0 * toEye + offset * across, .direction = -toEye};
      const auto hit = surfaceUnder(bandOf(model), model->solidBounds, ray);
      ASSERT_TRUE(hit.has_value()) << offset;
      const V3d truth = offset * across + std::sqrt(1 - offset * offset) * toEye;
      worst = std::max(worst, (hit->position - truth).length());
      worstNormal = std::max(worstNormal, (hit->normal - truth).length());
      EXPECT_LT(std::abs(levelset::BandSampler(bandOf(model)).value(hit->position)), 1e-8);
    }
  // At a grazing offset of 0.95 the trilinear error of φ is magnified three times.
  EXPECT_LT(worst, 3e-3);
  EXPECT_LT(worstNormal, 6e-3);
}

TEST(SurfaceRay, MissesBesideTheBallAndLeavesItFirst) {
  const auto model = ball();
  const auto hitOf = [&](const V3d& origin, const V3d& direction) {
    return surfaceUnder(bandOf(model), model->solidBounds,
                        {.origin = origin, .direction = direction});
  };
  EXPECT_FALSE(hitOf({1.01, 0, 5}, {0, 0, -1}).has_value());
  EXPECT_FALSE(hitOf({0, 0, 5}, {0, 0, 1}).has_value());
  EXPECT_FALSE(hitOf({0, 0, 0}, {0, 0, 1}).has_value());
  // From within one ball the ray leaves it, then enters the second ball.
  const auto two = modelOf(levelset::unite(levelset::makeSphere(1, V3d(0), 0.05),
                                           levelset::makeSphere(1, V3d(0, 0, 3), 0.05)));
  const auto hit =
      surfaceUnder(bandOf(two), two->solidBounds, {.origin = V3d(0), .direction = {0, 0, 1}});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->position.z, 2, 1e-3);
}

TEST(PointText, ReadsBackTheSameBits) {
  for (const V3d& point : {V3d(1.0 / 3, -2e-7, 12345.678912345), V3d(-0.0, 1e30, 1)}) {
    const V3d written = asWritten(point);
    EXPECT_EQ(pipeline::parsePoint(pointText(point), "test"), written);
    EXPECT_EQ(pointText(written), pointText(point));
  }
  EXPECT_EQ(pointText(V3d(-0.0, 0, 0)), "0,0,0");
}

TEST(PatchEditor, SnapsCornersToTheSurfaceAndOrdersThem) {
  const auto model = ball();
  PatchEditor editor(model);
  EXPECT_FALSE(editor.press(V2d(5, 5), camera()));  // beside the ball: the camera turns
  placeCorners(editor);
  const std::vector<V3d> corners = editor.design().corners;
  ASSERT_EQ(corners.size(), 4u);
  const levelset::BandSampler sampler(bandOf(model));
  double area = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    // Rounding to eight digits moves a corner by up to 5e-9.
    EXPECT_LT(std::abs(sampler.value(corners[i])), 2e-8);
    const V3d next = corners[(i + 1) % 4] - corners[i], last = corners[(i + 3) % 4] - corners[i];
    area += next.cross(last).dot(corners[i]);
  }
  EXPECT_GT(area, 0);
  // The first corner keeps its place, and lies where it was released.
  const V3d seen = corners[0] * camera().worldToNdc();
  EXPECT_NEAR(seen.x * 400, kClockwise[0][0], 1e-4);
  EXPECT_NEAR(seen.y * 300, kClockwise[0][1], 1e-4);
  // Beside a whole patch, the left button turns the camera.
  EXPECT_FALSE(editor.press(V2d(200, 70), camera()));
}

TEST(PatchEditor, UncrossesCornersThatWereGivenCrosswise) {
  const auto model = ball();
  PatchEditor editor(model);
  for (const std::size_t i : {0u, 2u, 1u, 3u})
    drag(editor, V2d(kClockwise[i][0] + 3, kClockwise[i][1]),
         V2d(kClockwise[i][0], kClockwise[i][1]));
  PatchEditor other(model);
  for (const std::size_t i : {0u, 3u, 2u, 1u})
    drag(other, V2d(kClockwise[i][0] + 3, kClockwise[i][1]),
         V2d(kClockwise[i][0], kClockwise[i][1]));
  EXPECT_EQ(editor.design(), other.design());
}

TEST(PatchEditor, MovesAPointAndKeepsItBesideTheSurface) {
  PatchEditor editor(ball());
  placeCorners(editor);
  const std::vector<V3d> before = editor.design().corners;
  // Held four pixels beside its middle, the corner keeps this distance from the pointer.
  const V2d grip(3, -2), corner(kClockwise[0][0], kClockwise[0][1]);
  ASSERT_TRUE(editor.press(corner + grip, camera()));
  EXPECT_TRUE(editor.moveTo(corner + V2d(-10, 0) + grip, camera()));
  const V3d moved = editor.design().corners[0];
  EXPECT_FALSE(editor.moveTo(V2d(2, 2), camera()));
  editor.release();
  EXPECT_EQ(editor.design().corners[0], moved);
  EXPECT_NEAR((moved * camera().worldToNdc()).x * 400, corner.x - 10, 1e-4);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(editor.design().corners[i], before[i]);
}

TEST(PatchEditor, AddsPointsToASideInTheirOrderAndRemovesThem) {
  const auto model = ball();
  PatchEditor editor(model);
  placeCorners(editor);
  const auto paths = [&] { return sidesOf(bandOf(model), editor.design()); };
  editor.setSides(paths());
  const auto middle = [&](double share) {
    const std::vector<V3d> path = paths()[1];
    const V3d point = path[static_cast<std::size_t>(share * static_cast<double>(path.size() - 1))];
    const V3d at = point * camera().worldToNdc();
    return V2d(at.x * 400, at.y * 300);
  };
  drag(editor, middle(0.75), middle(0.75) + V2d(8, 0));
  editor.setSides(paths());
  drag(editor, middle(0.25), middle(0.25) + V2d(8, 0));
  editor.setSides(paths());
  const std::vector<V3d> points = editor.design().sides[1];
  ASSERT_EQ(points.size(), 2u);
  const V3d start = editor.design().corners[1];
  EXPECT_LT((points[0] - start).length(), (points[1] - start).length());
  EXPECT_EQ(editor.marks(camera()).size(), 6u);
  EXPECT_TRUE(editor.removeSelected());
  EXPECT_EQ(editor.design().sides[1], std::vector<V3d>{points[1]});
  EXPECT_FALSE(editor.removeSelected());
  // Without a corner there is no side.
  ASSERT_TRUE(editor.press(V2d(kClockwise[0][0], kClockwise[0][1]), camera()));
  editor.release();
  EXPECT_TRUE(editor.removeSelected());
  EXPECT_EQ(editor.design().corners.size(), 3u);
  EXPECT_TRUE(editor.design().sides[1].empty());
}

TEST(PatchEditor, DoesNotHoldPointsOnTheOtherSide) {
  PatchEditor editor(ball());
  placeCorners(editor);
  render::Camera behind = camera();
  behind.from.z = -6;
  for (const PictureMark& mark : editor.marks(behind)) {
    EXPECT_TRUE(mark.isBehind);
    EXPECT_FALSE(editor.press(mark.place, behind));
  }
  for (const PictureMark& mark : editor.marks(camera())) EXPECT_FALSE(mark.isBehind);
}

TEST(PatchPreview, DrawsGreatCirclesOnABall) {
  const auto model = ball();
  PatchDesign design;
  const auto at = [](double degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    return V3d(std::sin(angle), 0, std::cos(angle));
  };
  design.corners = {at(0), at(80)};
  const PatchPaths sides = sidesOf(bandOf(model), design);
  EXPECT_NEAR(mapping::pathLength(sides[0]), 80 * std::numbers::pi / 180, 5e-3);
  EXPECT_TRUE(sides[1].empty());
  // A side through a point beside the great circle is longer: two arcs.
  design.sides[0] = {V3d(0, 0.6, 0.8)};
  const double first = std::acos(0.8),
               second = std::acos(0.8 * std::cos(80 * std::numbers::pi / 180));
  EXPECT_NEAR(mapping::pathLength(sidesOf(bandOf(model), design)[0]), first + second, 1e-2);
}

/// A patch in the middle of the ball, a third as large as that of kClockwise.
PatchDesign smallDesign(const std::shared_ptr<const Model>& model) {
  PatchEditor editor(model);
  for (const auto& [x, y] : kClockwise) {
    const V2d place = V2d(200, 150) + (V2d(x, y) - V2d(200, 150)) / 3;
    drag(editor, place, place);
  }
  PatchDesign design = editor.design();
  design.columns = 2;
  return design;
}

TEST(PatchPreview, TexturesTheSolidAndWritesTheActions) {
  const auto model = ball(0.04);
  for (const TextureKind kind : kTextureKinds) {
    PatchDesign design = smallDesign(model);
    design.texture = kind;
    const PatchPreview preview = previewPatch(*model, bandOf(model), design, PreviewQuality::Fine);
    ASSERT_EQ(preview.failure, "");
    ASSERT_TRUE(preview.patch.has_value());
    EXPECT_EQ(preview.patch->height, preview.height);
    EXPECT_EQ(preview.patchText.find("patch --corners \"" + pointText(design.corners[0]) + " "),
              0u);
    EXPECT_EQ(preview.model == nullptr, kind == TextureKind::None);
    if (!preview.model) continue;
    const double before = levelset::measure(bandOf(model)).volume,
                 after = levelset::measure(bandOf(preview.model)).volume;
    const V2d size = sizeOf(preview.sides);
    EXPECT_GT(after - before, 0.2 * preview.height * size.x * size.y) << textureName(kind);
    EXPECT_LT(after - before, 1.3 * preview.height * size.x * size.y) << textureName(kind);
    EXPECT_EQ(preview.chainText, "");  // the model is from no file
    Model read = *model;
    read.files = {"it's.ply"};
    const std::string chain =
        previewPatch(read, bandOf(model), design, PreviewQuality::Fine).chainText;
    EXPECT_EQ(chain.find("levelsmith read 'it'\\''s.ply' ! level-set --voxel 0.04 --as base ! "),
              0u)
        << chain;
    EXPECT_NE(chain.find(std::string(" ! ") + textureName(kind) + " --"), std::string::npos);
  }
}

TEST(PatchPreview, KeepsTheProportionsOfTheTexture) {
  PatchDesign design;
  design.texture = TextureKind::Knurl;
  design.columns = 4;
  // A diamond is 1 / cos 30° wide, 1 / sin 30° long, and as high as two depths of its grooves.
  const double width = 2 / std::sqrt(3.0);
  const V2d size(4 * width, 4 * 2.0);
  const double depth = 0.5;  // flanks of 90° and a pitch of 1
  EXPECT_NEAR(heightOf(design, size), 2 * depth, 1e-7);
  EXPECT_NEAR(heightOf(design, size * 0.1), 0.2 * depth, 1e-8);
  design.relief = 0.5;
  EXPECT_NEAR(heightOf(design, size), depth, 1e-7);
}

TEST(PatchPreview, SaysWhyAPatchFails) {
  const auto model = ball(0.08);
  PatchDesign design = smallDesign(model);
  std::swap(design.corners[1], design.corners[3]);
  const PatchPreview preview = previewPatch(*model, bandOf(model), design, PreviewQuality::Fine);
  EXPECT_NE(preview.failure.find("clockwise"), std::string::npos) << preview.failure;
  EXPECT_EQ(preview.model, nullptr);
  EXPECT_FALSE(preview.sides[0].empty());
  EXPECT_EQ(whyNoPatch(*model), "");
  EXPECT_NE(whyNoPatch(Model{}), "");
}

TEST(PatchWorker, GivesACoarseResultWhileDraggingAndThenAFineOne) {
  const auto model = ball(0.018);  // finer than the preview's 96 voxels
  PatchWorker worker(model, {});
  EXPECT_EQ(worker.preview(), nullptr);
  EXPECT_FALSE(worker.isBusy());
  const auto settle = [&] {
    while (worker.isBusy()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    return worker.preview();
  };
  PatchDesign design = smallDesign(model);
  design.texture = TextureKind::Hexagons;
  for (int i = 0; i < 10; ++i) worker.request(design, true);
  const auto coarse = settle();
  ASSERT_TRUE(coarse && coarse->model) << coarse->failure;
  EXPECT_FALSE(coarse->isFine);
  EXPECT_NEAR(bandOf(coarse->model).voxelSize(), previewVoxel(*model), 1e-12);
  design.columns = 3;
  worker.request(design, false);
  const auto fine = settle();
  ASSERT_TRUE(fine->isFine) << fine->failure;
  EXPECT_EQ(fine->design, design);
  EXPECT_EQ(bandOf(fine->model).voxelSize(), bandOf(model).voxelSize());
}

std::vector<InputStep> stepsOf(const std::string& text) {
  const support::TemporaryFolder folder;
  support::writeText(folder / "input.play", text);
  return readInputScript(folder / "input.play");
}

TEST(InputScript, ReadsAllCommands) {
  const std::vector<InputStep> steps = stepsOf(
      "# a comment\n\nclick 10,20  # places a corner\ndrag 0,0 8,16 8,0\nkey ctrl+c\n"
      "press right\nrelease middle\npress shift\nmove 1.5,2\nwait\ncopied\npicture a.png\n");
  using Kind = InputStep::Kind;
  ASSERT_EQ(steps.size(), 3u + 19 + 8);
  EXPECT_EQ(steps[0].place, V2d(10, 20));
  EXPECT_EQ(steps[1].kind, Kind::Press);
  EXPECT_EQ(steps[2].kind, Kind::Release);
  EXPECT_EQ(steps[5].place, V2d(1, 2));
  EXPECT_EQ(steps[12].place, V2d(8, 16));
  EXPECT_EQ(steps[20].place, V2d(8, 0));
  EXPECT_EQ(steps[21].kind, Kind::Release);
  EXPECT_EQ(steps[22].text, "ctrl+c");
  EXPECT_EQ(steps[23].button, 1);
  EXPECT_EQ(steps[24].button, 2);
  EXPECT_EQ(steps[25].button, InputStep::kShift);
  EXPECT_EQ(steps[26].place, V2d(1.5, 2));
  EXPECT_EQ(steps[29].text, "a.png");
}

TEST(InputScript, NamesTheLineOfAnError) {
  for (const std::string line :
       {"jump 1,2", "click 1", "click", "drag 1,2", "press first", "wait 3", "move 1,x", "key"}) {
    const std::string message =
        support::refusal<levelset::UsageError>([&] { (void)stepsOf("wait\n" + line + "\n"); });
    EXPECT_NE(message.find(":2"), std::string::npos) << message;
  }
  EXPECT_THROW((void)readInputScript("no/such.play"), levelset::IoError);
}

}  // namespace patch_editor_test
