#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <vector>

#include "levelset/segmented/segmented_to_mesh.h"

namespace levelset {

struct RegionMeasure {
  RegionLabel label = kVoid;
  double volume = 0;  ///< world units³; 0 for the void, which has no bounds
  double area = 0;    ///< area of its boundary, world units²
  std::size_t triangles = 0;
  Imath::Box3d bounds = {};  ///< box of its boundary
};

struct InterfaceMeasure {
  TriangleSides sides;
  double area = 0;  ///< world units²
  std::size_t triangles = 0;
};

struct SegmentedMeasurement {
  std::vector<RegionMeasure> regions;        ///< by label; the void first
  std::vector<InterfaceMeasure> interfaces;  ///< by front, then behind
  double volume = 0;                         ///< sum over all regions without the void
  double area = 0;                           ///< sum over all interfaces
  double junctionLength = 0;                 ///< length of all junction curves, world units
  std::size_t junctionPoints = 0, triangles = 0;
};

/// Measures the regions and interfaces of a partition on its mesh, exactly for the flat triangles.
/// Volumes and areas converge with second order. Sums run in a fixed order.
[[nodiscard]] SegmentedMeasurement measureSegmented(const SegmentedMesh& mesh);
[[nodiscard]] SegmentedMeasurement measureSegmented(const SegmentedField& field,
                                                    const SegmentedMeshOptions& options = {});

}  // namespace levelset
