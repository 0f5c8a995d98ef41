#pragma once

// Private to the ray casting of segmented fields: triangles of the sheets of a field.

#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/segmented/meshing/segmented_to_mesh.h"

namespace render {

/// Sheets of a segmented field, world space. They are those of levelset::segmentedToMesh(), with a
/// border where a sheet meets an interface. The mesh ends a sheet at the interface of the mesh.
/// Rays see the interpolated interface, which is a fraction of a voxel beside it. So the border
/// continues the sheet a little beyond the interpolated interface. Rays see a sheet only within its
/// region, which cuts the border off at the interface exactly.
struct SheetSurface {
  /// Twice the area below which rounding makes the normal of a triangle useless, voxels².
  static constexpr double kSliver = 1e-6;

  struct Triangle {
    std::array<std::uint32_t, 3> corners;
    levelset::RegionLabel label;  ///< region on both sides
    /// Unit normals of the smooth sheet at the corners, on one side of it. 0 on strips without
    /// width.
    std::array<Imath::V3f, 3> normals;
  };
  std::vector<Imath::V3d> positions;                ///< those of the mesh, then those of borders
  std::vector<Triangle> triangles;                  ///< those of the mesh, then those of borders
  std::size_t meshVertices = 0, meshTriangles = 0;  ///< those of the mesh
};

/// Finds the sheets of a field. @return null if there are none
/// @throws levelset::ResourceLimit when the mesh exceeds `maxBytes`
[[nodiscard]] std::shared_ptr<const SheetSurface> sheetSurface(
    const levelset::SegmentedField& field, std::size_t maxBytes);

}  // namespace render
