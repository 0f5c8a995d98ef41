#pragma once

#include "levelset/csg/csg.h"
#include "levelset/shapes/shapes.h"
#include "render/camera.h"
#include "render/scene/scene.h"

/// Small scenes that are difficult for ray casters.
namespace support {

inline render::Scene sceneOf(const levelset::NarrowBand& band, int width = 160, int height = 120) {
  render::Scene scene;
  scene.solids.push_back({.band = band});
  scene.camera = render::framingCamera(band.zeroSetBounds(), width, height);
  return scene;
}

/// Two linked tori whose union has a crease.
inline levelset::NarrowBand rings() {
  using Imath::V3d;
  return levelset::unite(levelset::makeTorus(24, 8, V3d(0), V3d(0, 0, 1), 1),
                         levelset::makeTorus(24, 8, V3d(9, 0, 3), V3d(0, 1, 0), 1));
}

/// View from a distance of 1e5 world units, with a field of view that the solid fills.
inline render::Scene seenFromFar(const levelset::NarrowBand& band) {
  render::Scene scene = sceneOf(band);
  render::Camera& camera = scene.camera;
  camera.from = camera.to + (camera.from - camera.to).normalized() * 1e5;
  camera.verticalFov = 1.2 * band.zeroSetBounds().size().length() / 1e5;
  return scene;
}

/// Orthographic view with pixels of one world unit, so that rays run through grid points, along
/// edges and in faces of cells.
inline render::Scene alongTheLattice(const levelset::NarrowBand& band, const Imath::V3d& from) {
  render::Scene scene = sceneOf(band, 128, 64);  // in this view no position is rounded
  const Imath::V3d half(from.x == 0 ? 0.5 : 0, from.y == 0 ? 0.5 : 0, from.z == 0 ? 0.5 : 0);
  scene.camera.from = from + half;
  scene.camera.to = half;
  if (from.x == 0 && from.z == 0) scene.camera.up = Imath::V3d(0, 0, 1);
  scene.camera.orthoHeight = 64;
  return scene;
}

/// Box with all faces on grid points. Cells have zeros on a face, an edge or in a corner.
inline levelset::NarrowBand latticeBox() {
  return levelset::makeBox(Imath::V3d(32, 24, 16), Imath::V3d(0), 1);
}

}  // namespace support
