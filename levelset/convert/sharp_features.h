#pragma once

// Edges and corners between the vertices of a mesh. Includes OpenVDB: for .cpp files only.

#include <array>
#include <vector>

#include "levelset/convert/cell_surface.h"

namespace levelset {

/// The unit normals of the sheets of the surface that meet at a vertex: one on a smooth part, two
/// on an edge, three at a corner. None: nothing is known there.
struct VertexSheets {
  static constexpr std::size_t kMost = 4;
  std::uint8_t count = 0;
  std::array<openvdb::Vec3f, kMost> normal = {};
};

/// Sheets whose normals are less than that far apart are one.
inline constexpr double kOneSheetCosine = 0.9;

/// How far the middle of a segment between two vertices is from the sheets of both, voxels: 0 when
/// it runs in a sheet that they share.
[[nodiscard]] double sheetGap(const openvdb::Vec3d& from, const VertexSheets& fromSheets,
                              const openvdb::Vec3d& to, const VertexSheets& toSheets);

/// Makes mesh edges follow the edges of the solid, after Kobbelt et al. [Kobbelt01]: a mesh edge
/// that cuts across one is flipped to run along it, or gets a vertex where the sheets of its ends
/// meet; a triangle whose vertices have no sheet in common gets one at the corner where three
/// sheets meet. Positions are in voxels. The mesh stays closed and 2-manifold.
/// @param sheets  one for each vertex; grows with the mesh
void insertFeatures(IndexMesh& mesh, std::vector<VertexSheets>& sheets);

}  // namespace levelset
