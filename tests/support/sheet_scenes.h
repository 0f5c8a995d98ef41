#pragma once

// Segmented fields with sheets, for tests of ray casting.

#include <numbers>
#include <string>
#include <vector>

#include "levelset/segmented/sources/segment_mesh.h"
#include "tests/support/segmented_scenes.h"
#include "tests/support/sheet_meshes.h"

namespace support {

/// Lets grid points lie beside flat sheets, not on them.
inline const V3d kSheetPlace(0.013, 0.021, 0.037);

inline levelset::SegmentedField sheetField(const TriMesh& mesh, double voxel) {
  return levelset::segmentMesh(mesh, voxel, {.keepsSheets = true}).field;
}

/// Part of the unit sphere around the origin up to an angle from the z axis, radians. It is open.
inline TriMesh capMesh(double angle, unsigned rings) {
  return patchMesh(4 * rings, rings, true, false, [&](double u, double v) {
    const double a = 2 * std::numbers::pi * u, b = angle * (0.02 + 0.98 * v);
    return V3d(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b));
  });
}

/// A disk, a book of five pages, a Möbius strip, a Klein bottle, a box with walls and a door, and a
/// ball with a diaphragm with a hole; all around the origin. The bottle has junctions, but no
/// sheets: its two sides are two regions. `hidden` makes the inside visible.
inline std::vector<SegmentedScene> sheetScenes(double voxel = 0.1) {
  std::vector<SegmentedScene> scenes;
  scenes.push_back({"disk", sheetField(ringMesh(0, 1, tiltedFrame(kSheetPlace, 15)), voxel)});
  scenes.push_back(
      {"book", sheetField(bookMesh({0, 72, 144, 216, 288}, 0.9, 1.6, turnedFrame(kSheetPlace, 0.7)),
                          voxel)});
  scenes.push_back({"strip", sheetField(moebiusMesh(0.8, tiltedFrame(kSheetPlace, 20)), voxel)});
  scenes.push_back({"bottle", sheetField(kleinMesh(0.5, tiltedFrame(kSheetPlace, 0)), voxel)});
  scenes.push_back({"door", sheetField(boxWithDoor(V3d(-1.5, -1, -1) + kSheetPlace), voxel), {1}});
  scenes.push_back(
      {"diaphragm", sheetField(sphereWithHoledDiaphragm(kSheetPlace, 0.4, 32), voxel), {1}});
  return scenes;
}

}  // namespace support
