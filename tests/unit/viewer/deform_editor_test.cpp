// Deforming a solid in the viewer: dragging control points, undo, the files and the text of the
// action, and the work in the background.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <new>
#include <string>
#include <thread>

#include "apps/viewer/editing/background_work.h"
#include "apps/viewer/editing/deform_editor.h"
#include "apps/viewer/editing/deform_preview.h"
#include "apps/viewer/editing/solid_model.h"
#include "levelset/deform/deform_band.h"
#include "levelset/deform/lattice_file.h"
#include "levelset/error.h"
#include "levelset/grids/sample.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/shapes/shapes.h"
#include "tests/support/cages.h"
#include "tests/support/files.h"

namespace deform_editor_test {

using namespace viewer;
using Imath::V2d;
using Imath::V3d;

constexpr double kVoxel = 0.05;

std::shared_ptr<const Model> ballOf(double voxel = kVoxel) {
  auto model = std::make_shared<Model>();
  model->scene.solids.push_back({.band = levelset::makeSphere(1, V3d(0), voxel), .name = "ball"});
  model->solidBounds = model->bounds = model->scene.bounds();
  return model;
}

DeformDesign box(const BoxLattice& lattice = {}) {
  return boxDesign({V3d(-1), V3d(1)}, kVoxel, lattice);
}

/// Oblique cameras: in perspective, and orthographic.
render::Camera obliqueCamera(bool isOrtho) {
  render::Camera camera;
  camera.from = {2, 3, 6};
  camera.width = 400;
  camera.height = 300;
  if (isOrtho) camera.orthoHeight = 4;
  return camera;
}

/// Place of a control point in the picture.
V2d placeOf(const DeformEditor& editor, std::size_t point, const render::Camera& camera) {
  return *seenAt(editor.design().points()[point], camera);
}

void drag(DeformEditor& editor, std::size_t point, const V2d& way, const render::Camera& camera) {
  const V2d from = placeOf(editor, point, camera);
  ASSERT_TRUE(editor.press(from, camera));
  editor.moveTo(from + way * 0.5, camera);
  editor.moveTo(from + way, camera);
  editor.release();
}

TEST(DragOffset, StaysInThePlaneThatFacesTheCamera) {
  for (const bool isOrtho : {false, true}) {
    const render::Camera camera = obliqueCamera(isOrtho);
    const V3d point(0.3, -0.4, 0.8);
    const V2d place = *seenAt(point, camera) + V2d(37, -21);
    const auto offset = dragOffset(point, place, camera, std::nullopt);
    ASSERT_TRUE(offset.has_value());
    // Rounding of products with distances of about 7.
    EXPECT_NEAR(offset->dot(camera.axis()), 0, 2e-15);
    EXPECT_LT((*seenAt(point + *offset, camera) - place).length(), 1.5e-13);
    EXPECT_GT(offset->length(), 0.1);
  }
}

TEST(DragOffset, FollowsAnAxisToThePointNearestToTheRay) {
  for (const bool isOrtho : {false, true})
    for (int axis = 0; axis < 3; ++axis) {
      const render::Camera camera = obliqueCamera(isOrtho);
      const V3d point(0.3, -0.4, 0.8);
      V3d line(0);
      line[axis] = 1;
      // A place on the line: the offset is exact.
      const V3d truth = line * 0.37;
      const auto offset = dragOffset(point, *seenAt(point + truth, camera), camera, axis);
      ASSERT_TRUE(offset.has_value());
      EXPECT_LT((*offset - truth).length(), 8e-15) << axis;
      // A place beside it: no point of the line is nearer to the ray.
      const V2d beside = *seenAt(point + truth, camera) + V2d(11, 9);
      const render::Camera::Ray ray = camera.ray(beside.x, beside.y);
      const auto distanceAt = [&](double t) {
        return (point + line * t - ray.origin).cross(ray.direction).length();
      };
      const double least = (*dragOffset(point, beside, camera, axis))[axis];
      EXPECT_LT(distanceAt(least), distanceAt(least + 1e-4));
      EXPECT_LT(distanceAt(least), distanceAt(least - 1e-4));
    }
}

TEST(DragOffset, RefusesAnAxisThatPointsAtTheEye) {
  render::Camera camera;
  camera.from = {0, 0, 5};
  EXPECT_FALSE(dragOffset(V3d(0), V2d(512, 512), camera, 2).has_value());
  EXPECT_TRUE(dragOffset(V3d(0), V2d(512, 512), camera, 0).has_value());
}

TEST(BoxLatticeDesign, IsTheIdentityAroundTheSolid) {
  const DeformDesign design = box();
  EXPECT_TRUE(design.deformation()->isIdentity());
  EXPECT_EQ(design.points().size(), 64u);
  EXPECT_EQ(design.net().size(), 3u * 3 * 16);
  const Imath::Box3d bounds = design.lattice().bounds();
  EXPECT_NEAR(bounds.min.x, -1 - 2 * kVoxel, 1e-15);
  EXPECT_NEAR(bounds.max.z, 1 + 2 * kVoxel, 1e-15);
  // Two points along an axis allow degree 1 only.
  const DeformDesign flat = box({.count = {2, 5, 3}, .degree = 3});
  EXPECT_EQ(flat.lattice().data().axes[0].degree, 1);
  EXPECT_EQ(flat.lattice().data().axes[1].degree, 3);
  EXPECT_EQ(flat.lattice().data().axes[2].degree, 2);
  EXPECT_TRUE(flat.deformation()->isIdentity());
}

TEST(DeformEditor, DragsAPointUnderThePointer) {
  const render::Camera camera = obliqueCamera(false);
  DeformEditor editor(box());
  EXPECT_FALSE(editor.press(V2d(3, 3), camera));
  const V2d place = placeOf(editor, 63, camera), grip(3, -2);
  ASSERT_TRUE(editor.press(place + grip, camera));
  EXPECT_TRUE(editor.isDragging());
  EXPECT_FALSE(editor.moveTo(place + grip, camera));  // a click moves nothing, to the bit
  EXPECT_EQ(editor.design().points(), box().points());
  EXPECT_TRUE(editor.moveTo(place + grip + V2d(20, 10), camera));
  editor.release();
  EXPECT_LT((placeOf(editor, 63, camera) - place - V2d(20, 10)).length(), 8e-14);
  for (std::size_t n = 0; n < 63; ++n) EXPECT_EQ(editor.design().points()[n], box().points()[n]);
  EXPECT_FALSE(editor.design().deformation()->isIdentity());
}

TEST(DeformEditor, MovesSelectedPointsTogetherAlongAnAxis) {
  const render::Camera camera = obliqueCamera(false);
  DeformEditor editor(box());
  ASSERT_TRUE(editor.press(placeOf(editor, 63, camera), camera));
  editor.release();
  ASSERT_TRUE(editor.press(placeOf(editor, 47, camera), camera, true));
  editor.release();
  EXPECT_EQ(editor.selectedCount(), 2u);
  editor.setAxis(1);
  drag(editor, 63, V2d(5, -30), camera);
  const V3d way = editor.design().points()[63] - box().points()[63];
  EXPECT_GT(way.y, 0.1);
  EXPECT_EQ(way.x, 0);
  EXPECT_EQ(way.z, 0);
  EXPECT_LT((editor.design().points()[47] - box().points()[47] - way).length(), 5e-16);
  EXPECT_EQ(editor.design().points()[46], box().points()[46]);
  // A second press with shift removes a point from the selection, and does not drag it.
  const V2d at = placeOf(editor, 47, camera);
  ASSERT_TRUE(editor.press(at, camera, true));
  EXPECT_FALSE(editor.moveTo(at + V2d(20, 20), camera));
  editor.release();
  EXPECT_EQ(editor.selectedCount(), 1u);
}

TEST(DeformEditor, SelectsLayers) {
  const render::Camera camera = obliqueCamera(false);
  for (int axis = 0; axis < 3; ++axis) {
    DeformEditor editor(box({.count = {3, 4, 5}, .degree = 2}));
    ASSERT_TRUE(editor.press(placeOf(editor, 59, camera), camera));
    editor.release();
    editor.selectLayer(axis);
    const std::array<std::size_t, 3> sizes = {20, 15, 12};
    EXPECT_EQ(editor.selectedCount(), sizes[static_cast<std::size_t>(axis)]);
    const std::vector<PictureMark> marks = editor.marks(camera);
    for (std::size_t n = 0; n < marks.size(); ++n)
      EXPECT_EQ(marks[n].isSelected, box({.count = {3, 4, 5}, .degree = 2}).points()[n][axis] ==
                                         editor.design().points()[59][axis]);
  }
}

TEST(DeformEditor, UndoesAndRedoes) {
  const render::Camera camera = obliqueCamera(true);
  DeformEditor editor(box());
  EXPECT_FALSE(editor.undo());
  drag(editor, 63, V2d(20, 0), camera);
  const std::vector<V3d> first = editor.design().points();
  drag(editor, 0, V2d(0, 15), camera);
  const std::vector<V3d> second = editor.design().points();
  EXPECT_TRUE(editor.undo());
  EXPECT_EQ(editor.design().points(), first);
  EXPECT_TRUE(editor.undo());
  EXPECT_EQ(editor.design().points(), box().points());
  EXPECT_FALSE(editor.undo());
  EXPECT_TRUE(editor.redo());
  EXPECT_TRUE(editor.redo());
  EXPECT_EQ(editor.design().points(), second);
  EXPECT_FALSE(editor.redo());
  // Only the selected point goes back to rest. A new change forgets what was undone.
  EXPECT_TRUE(editor.undo());
  EXPECT_TRUE(editor.reset() == false && editor.canRedo());
  editor.selectNone();
  EXPECT_TRUE(editor.reset());
  EXPECT_EQ(editor.design().points(), box().points());
  EXPECT_FALSE(editor.redo());
  EXPECT_TRUE(editor.undo());
  EXPECT_EQ(editor.design().points(), first);
}

TEST(DeformDesign, WritesLatticesThatReadBackTheSameBits) {
  const support::TemporaryFolder folder;
  std::vector<V3d> points = box().points();
  points[21] += V3d(0.1, 1.0 / 3, -0.2);
  const DeformDesign design = box().withPoints(points);
  design.save(folder / "my lattice.json");
  EXPECT_TRUE(levelset::isLatticeFile(folder / "my lattice.json"));
  EXPECT_EQ(readLatticeDesign(folder / "my lattice.json").points(), points);
  EXPECT_EQ(design.action("my lattice.json"), "deform --lattice 'my lattice.json'");
  support::writeText(folder / "scene.json", "{\"format\": \"levelsmith scene\", \"points\": []}");
  EXPECT_FALSE(levelset::isLatticeFile(folder / "scene.json"));
  EXPECT_FALSE(levelset::isLatticeFile(folder / "none.json"));
  auto model = std::make_shared<Model>(*ballOf());
  EXPECT_EQ(deformChain(*model, design, "a.json"), "");
  model->files = {"ball.vdb"};
  EXPECT_EQ(deformChain(*model, design, "a.json"),
            "levelsmith read 'ball.vdb' ! deform --lattice 'a.json' ! write deformed.vdb");
}

TEST(DeformDesign, EditsCages) {
  const support::TemporaryFolder folder;
  const levelset::TriMesh rest = support::boxCage(V3d(-2), V3d(2), 1);
  levelset::writeMesh(folder / "rest.ply", rest);
  const DeformDesign design =
      readCageDesign(folder / "rest.ply", "", levelset::CageCoordinates::Green);
  EXPECT_TRUE(design.deformation()->isIdentity());
  EXPECT_EQ(design.net().size(), 18u);  // 12 edges and 6 diagonals
  const render::Camera camera = obliqueCamera(false);
  DeformEditor editor(design);
  drag(editor, 7, V2d(15, 5), camera);
  EXPECT_NE(editor.design().points()[7], rest.positions[7]);
  editor.design().save(folder / "moved.ply");
  const DeformDesign read =
      readCageDesign(folder / "rest.ply", folder / "moved.ply", levelset::CageCoordinates::Green);
  EXPECT_EQ(read.points(), editor.design().points());
  EXPECT_EQ(read.action("m.ply"), "deform --cage '" + (folder / "rest.ply").string() +
                                      "' --to 'm.ply' --coordinates green");
  editor.selectNone();
  EXPECT_TRUE(editor.reset());
  EXPECT_EQ(editor.design().points(), rest.positions);
}

/// Waits until the worker has finished, and returns its last result.
std::shared_ptr<const DeformPreview> settled(const DeformWorker& worker) {
  while (worker.isBusy()) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  return worker.preview();
}

DeformDesign movedBy(const V3d& way) {
  std::vector<V3d> points = box().points();
  for (const std::size_t n : {42u, 43u, 46u, 47u, 58u, 59u, 62u, 63u}) points[n] += way;
  return box().withPoints(points);
}

TEST(DeformEditor, ResetsNoLatticeWithWeights) {
  EXPECT_TRUE(box().hasRestPoints());
  levelset::LatticeData data = box().lattice().data();
  data.weights.assign(data.points.size(), 1);
  data.weights[3] = 2;
  const DeformDesign weighted{levelset::ControlLattice(data)};
  EXPECT_FALSE(weighted.hasRestPoints());
  data.points[0].x -= 0.5;
  DeformEditor editor(weighted.withPoints(data.points));
  EXPECT_FALSE(editor.reset());
  EXPECT_EQ(editor.design().points(), data.points);
}

TEST(BackgroundWork, GoesOnAfterAnErrorThatCannotBeTold) {
  using Work = BackgroundWork<int, int>;
  Work work(
      [](int request, Work& own) {
        if (request < 0) throw levelset::InvalidInput("negative");
        own.publish(request);
      },
      [](int, const std::string&) -> int { throw std::bad_alloc(); }, {});
  const auto finish = [&](int request) {
    work.request(request);
    while (work.isBusy()) std::this_thread::yield();
  };
  finish(-1);
  EXPECT_EQ(work.result(), nullptr);
  finish(7);
  ASSERT_NE(work.result(), nullptr);
  EXPECT_EQ(*work.result(), 7);
}

TEST(DeformWorker, ShowsAMeshWhileDraggingAndThenTheSolidOfTheAction) {
  const auto model = ballOf();
  DeformWorker worker(model, {});
  const DeformDesign design = movedBy(V3d(0.3, 0.1, 0.2));
  for (int i = 0; i < 5; ++i) worker.request(movedBy(V3d(0.1 * i, 0, 0)), true);
  worker.request(design, true);
  const auto coarse = settled(worker);
  ASSERT_TRUE(coarse && coarse->model && coarse->certificate);
  EXPECT_FALSE(coarse->isFine);
  EXPECT_EQ(coarse->design.points(), design.points());
  ASSERT_EQ(coarse->model->scene.meshes.size(), 1u);
  EXPECT_TRUE(coarse->certificate->isInjective());
  EXPECT_NE(coarse->certificateText().find("certified"), std::string::npos);
  worker.request(design, false);
  const auto fine = settled(worker);
  ASSERT_TRUE(fine->isFine) << fine->failure;
  const levelset::DeformBandResult made =
      levelset::deformBand(model->scene.solids.front().band, *design.deformation());
  EXPECT_EQ(fine->model->scene.solids.front().band.contentHash(), made.band.contentHash());
  EXPECT_EQ(fine->certificate->leastLow, made.certificate.leastLow);
  // The mesh lies on the solid: its vertices were moved by the same map.
  double worst = 0;
  const levelset::BandSampler sampler(made.band);
  for (const V3d& point : coarse->model->scene.meshes.front().mesh->positions)
    worst = std::max(worst, std::abs(sampler.value(point)));
  EXPECT_LT(worst, 0.04 * kVoxel);  // measured 0.015
}

TEST(DeformWorker, ShowsFoldsAndRefusesThem) {
  DeformWorker worker(ballOf(), {});
  worker.request(movedBy(V3d(-3, -3, -3)), false);
  const auto folded = settled(worker);
  ASSERT_TRUE(folded && folded->model && folded->certificate);
  EXPECT_TRUE(folded->isRefused());
  EXPECT_FALSE(folded->isFine);
  EXPECT_LE(folded->certificate->leastHigh, 0);
  EXPECT_NE(folded->certificateText().find("folds"), std::string::npos);
  EXPECT_NE(folded->failure.find("folds"), std::string::npos) << folded->failure;
  EXPECT_EQ(folded->model->scene.meshes.size(), 1u);
  EXPECT_NE(whyNoDeformation(Model{}), "");
  EXPECT_EQ(whyNoDeformation(*ballOf()), "");
}

TEST(DeformWorker, DeformsByCages) {
  const support::TemporaryFolder folder;
  levelset::writeMesh(folder / "rest.ply", support::boxCage(V3d(-2), V3d(2), 1));
  const DeformDesign rest =
      readCageDesign(folder / "rest.ply", "", levelset::CageCoordinates::MeanValue);
  std::vector<V3d> points = rest.points();
  for (V3d& p : points)
    if (p.x > 0) p.x += 1;
  const DeformDesign design = rest.withPoints(points);
  const auto model = ballOf(0.1);
  DeformWorker worker(model, {});
  worker.request(design, false);
  const auto preview = settled(worker);
  ASSERT_TRUE(preview->isFine) << preview->failure;
  EXPECT_TRUE(preview->certificate->isInjective());
  const levelset::DeformBandResult made =
      levelset::deformBand(model->scene.solids.front().band, *design.deformation());
  EXPECT_EQ(preview->model->scene.solids.front().band.contentHash(), made.band.contentHash());
  // The cage stretches by 5/4.
  EXPECT_NEAR(preview->model->bounds.size().x, 2.5, 8e-5);
}

TEST(DeformedMesh, TransformsNormalsAlsoOfMirrors) {
  const levelset::NarrowBand ball = levelset::makeSphere(1, V3d(0), 0.1);
  const levelset::TriMesh mesh = previewMesh(ball, 0.2);
  EXPECT_LT(mesh.positions.size(), previewMesh(ball, 0.1).positions.size());
  std::vector<V3d> points = box().points();
  for (V3d& p : points) p.x *= -2;
  const levelset::TriMesh moved = deformedMesh(mesh, *box().withPoints(points).deformation());
  double worst = 0;
  for (std::size_t n = 0; n < mesh.positions.size(); ++n) {
    const V3d& p = mesh.positions[n];
    EXPECT_LT((moved.positions[n] - V3d(-2 * p.x, p.y, p.z)).length(), 3e-15);
    const V3d normal = mesh.attributes.normals[n] * V3d(-0.5, 1, 1);
    worst = std::max(worst, (moved.attributes.normals[n] - normal.normalized()).length());
  }
  EXPECT_LT(worst, 1.3e-15);
}

}  // namespace deform_editor_test
