#pragma once

// Segmented fields and views of them, for tests of ray casting.

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "levelset/segmented/segment_labels.h"
#include "levelset/segmented/segment_solids.h"
#include "levelset/shapes/shapes.h"
#include "render/camera.h"
#include "render/segmented/interface_caster.h"
#include "tests/support/segmented.h"

namespace support {

struct SegmentedScene {
  std::string name;
  levelset::SegmentedField field;
  std::vector<levelset::RegionLabel> hidden = {};
};

inline levelset::SegmentedField fieldOf(const std::vector<levelset::NarrowBand>& solids) {
  return levelset::segmentSolids(solids).field;
}

/// A ball within a ball, labels 1 (outer) and 2 (inner), both around the origin.
inline levelset::SegmentedField nestedBalls(double outer, double inner, double voxel) {
  return fieldOf(
      {levelset::makeSphere(outer, V3d(0), voxel), levelset::makeSphere(inner, V3d(0), voxel)});
}

/// Three balls that overlap, labels 1 to 3.
inline levelset::SegmentedField threeBalls(double voxel) {
  return fieldOf({levelset::makeSphere(1, V3d(0), voxel),
                  levelset::makeSphere(0.8, V3d(0.7, 0.2, 0.1), voxel),
                  levelset::makeSphere(0.7, V3d(0.1, 0.8, 0.3), voxel)});
}

/// Volume of labels on a turned grid of n³ samples around the origin, about 2.4 wide.
inline levelset::Volume turnedLabels(int n, const std::function<double(const V3d&)>& label) {
  levelset::VolumeGrid grid;
  grid.size = Imath::V3i(n);
  const double spacing = 2.4 / n;
  Imath::M44d map;
  map.rotate(V3d(0.3, -0.5, 0.8));
  map = Imath::M44d().setTranslation(V3d(-0.5 * (n - 1))) * Imath::M44d().setScale(V3d(spacing)) *
        map;
  grid.indexToWorld = map;
  std::vector<float> values;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) values.push_back(static_cast<float>(label(V3d(i, j, k) * map)));
  return {grid, values};
}

/// Four tissues in a ball: a shell, and three sectors of what is in it.
inline double tissueAt(const V3d& p) {
  if (p.length() > 1) return 0;
  if (p.length() > 0.75 + 0.1 * p.x) return 5;
  const double angle = std::atan2(p.y + 0.1 * p.z, p.x - 0.05);
  return angle < -1 ? 7 : angle < 1.2 ? 300 : 9;
}

/// Six scenes. Voxels are about 1/12 of the radius. With junctions, thin shells, faceted
/// interfaces, smoothed ones on a turned grid, and slabs in contact.
inline std::vector<SegmentedScene> segmentedScenes() {
  const double voxel = 0.083;
  std::vector<SegmentedScene> scenes;
  scenes.push_back({"nested", nestedBalls(1, 0.62, voxel), {1}});
  scenes.push_back({"overlap", threeBalls(voxel), {3}});
  scenes.push_back({"sectors", fieldOf(ballSectors(turnedFrame(V3d(0.02), 0.7), 1, voxel)), {2}});
  scenes.push_back({"faceted", levelset::segmentLabels(turnedLabels(26, tissueAt)), {5}});
  scenes.push_back(
      {"smoothed", levelset::segmentLabels(turnedLabels(28, tissueAt), {.smooth = 1}), {5, 300}});
  scenes.push_back({"slabs",
                    fieldOf({levelset::makeBox(V3d(1.6, 1.2, 0.5), V3d(0, 0, -0.25), voxel),
                             levelset::makeBox(V3d(1.6, 1.2, 0.11), V3d(0, 0, 0.055), voxel),
                             levelset::makeBox(V3d(1.2, 1.6, 0.6), V3d(0.1, 0, 0.41), voxel)}),
                    {2}});
  return scenes;
}

/// Views from outside in perspective, along the grid in parallel, from inside, and with a near
/// depth that cuts the regions open.
inline std::vector<render::Camera> segmentedViews(int width, int height) {
  render::Camera far{.from = {2.6, 1.7, 3.1}, .to = {0, 0, 0}, .width = width, .height = height};
  render::Camera along = far;
  along.from = {0, 0, 4};
  along.orthoHeight = 2.3;
  render::Camera inside = far;
  inside.from = {0.11, -0.07, 0.05};
  inside.to = {0.4, 1, -0.3};
  inside.verticalFov = 1.9;
  render::Camera cut = far;
  cut.from = {-3, 0.4, 1};
  cut.near = 3.0;
  return {far, along, inside, cut};
}

/// Rays through the centres of the pixels of a view.
inline std::vector<render::InterfaceRay> raysOf(const render::Camera& camera) {
  std::vector<render::InterfaceRay> rays;
  const render::CameraRays through(camera);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const render::Camera::Ray ray = through.at(x + 0.5, y + 0.5);
      rays.push_back({ray.origin, ray.direction, ray.near, ray.far});
    }
  return rays;
}

}  // namespace support
