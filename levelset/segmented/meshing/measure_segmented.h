#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <vector>

#include "levelset/segmented/meshing/segmented_to_mesh.h"

namespace levelset {

struct RegionMeasure {
  RegionLabel label = kVoid;
  double volume = 0;     ///< world units³; 0 for the void, which has no bounds
  double area = 0;       ///< area of its boundary to other regions, world units²
  double sheetArea = 0;  ///< area of the sheets inside, of one side each, world units²
  std::size_t triangles = 0;
  Imath::Box3d bounds = {};  ///< box of its boundary and sheets
};

struct InterfaceMeasure {
  TriangleSides sides;
  double area = 0;  ///< world units²
  std::size_t triangles = 0;
};

struct SegmentedMeasurement {
  std::vector<RegionMeasure> regions;  ///< by label; the void first
  /// By front, then behind. Sheets have the same label on both sides.
  std::vector<InterfaceMeasure> interfaces;
  double volume = 0;          ///< sum over all regions without the void
  double area = 0;            ///< sum over all interfaces and sheets
  double junctionLength = 0;  ///< length of all junction curves, world units
  double rimLength = 0;       ///< length of the rims of all sheets, world units
  std::size_t junctionPoints = 0, triangles = 0;
};

/// Measures the regions and interfaces of a partition on its mesh, exactly for the flat triangles.
/// Volumes and areas converge with second order. Sums run in a fixed order. Strips without width
/// have no area. Junction curves on both sides of a strip count once, also where they fold back.
[[nodiscard]] SegmentedMeasurement measureSegmented(const SegmentedMesh& mesh);
[[nodiscard]] SegmentedMeasurement measureSegmented(const SegmentedField& field,
                                                    const SegmentedMeshOptions& options = {});

}  // namespace levelset
