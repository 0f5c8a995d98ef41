#pragma once

// Finds edges and corners of a solid that lie between the vertices of its mesh, and adds them to
// the mesh. Internal header of levelset: public headers must not include it.

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "levelset/meshing/cells/cell_surface.h"
#include "levelset/progress.h"

namespace levelset {

/// Unit normals of the sheets that meet at a vertex; a sheet is a smooth part of the surface. A
/// vertex on a smooth part has one sheet, on an edge two, at a corner three. `count` 0: the sheets
/// are unknown.
struct VertexSheets {
  static constexpr std::size_t kMost = 4;
  std::uint8_t count = 0;
  std::array<openvdb::Vec3f, kMost> normal = {};
};

[[nodiscard]] inline openvdb::Vec3d sheetNormal(const VertexSheets& sheets, std::size_t i) {
  return openvdb::Vec3d(sheets.normal[i]);
}

/// Two sheets whose unit normals have a larger dot product count as one sheet.
inline constexpr double kOneSheetCosine = 0.9;

/// Returns true when a segment runs in one sheet. It starts at a vertex with a sheet of normal `n`
/// and ends at a vertex with the sheets `sheets`. The chord of a round face is perpendicular to the
/// mean of the normals at its ends, which the second test uses.
/// @param to  vector from start to end, voxels
[[nodiscard]] inline bool isInSheet(const openvdb::Vec3d& n, const openvdb::Vec3d& to,
                                    const VertexSheets& sheets) {
  constexpr double kOff = 0.03;  // voxels: largest distance of the end from the sheet's plane
  if (std::abs(n.dot(to)) < kOff) return true;
  for (std::size_t i = 0; i < sheets.count; ++i) {
    const openvdb::Vec3d other = sheetNormal(sheets, i);
    if (other.dot(n) > kOneSheetCosine && std::abs((n + other).dot(to)) < 2 * kOff) return true;
  }
  return false;
}

/// Accuracy of the tangent planes to which a vertex was fitted.
struct SheetQuality {
  double misfit = 0;  ///< largest distance of the vertex from a plane, voxels
  double bend = 1;    ///< largest second difference of the field beside the planes, voxels
};

/// Finds the vertices near confirmed edges of the solid and moves them onto the edges.
/// An edge is confirmed when three conditions hold. A vertex has several sheets, the surface around
/// it lies in the planes of these sheets, and each sheet is somewhere much flatter than a round
/// surface that turns by the same angle. On a smooth surface no edge is confirmed, whatever its
/// curvature. Edges that are rounded by a voxel or more are not confirmed either: the values beside
/// them differ from the distances to the planes. A vertex moves to the point where the planes of
/// its sheets meet. The planes come from the flattest parts nearby, since the field is not linear
/// at the grid points next to an edge.
/// @param field    field whose zero set `mesh` triangulates in index space
/// @param sheets   sheets at each vertex; replaced where a flatter plane is nearby
/// @param quality  accuracy of the sheets at each vertex
/// @return true for each vertex near a confirmed edge
[[nodiscard]] std::vector<bool> confirmFeatures(IndexMesh& mesh, const openvdb::FloatGrid& field,
                                                std::vector<VertexSheets>& sheets,
                                                const std::vector<SheetQuality>& quality,
                                                const Progress& progress);

/// Returns how far one end of a segment is from the nearest sheet through the other end, voxels. 0
/// when the segment runs in a sheet of either end, or an end has no sheets.
[[nodiscard]] double sheetGap(const openvdb::Vec3d& from, const VertexSheets& fromSheets,
                              const openvdb::Vec3d& to, const VertexSheets& toSheets);

/// Aligns mesh edges with the edges of the solid, after Kobbelt et al. [Kobbelt01].
/// A mesh edge that cuts across an edge of the solid is flipped to run along it, or split where the
/// sheets of its ends meet. A triangle whose vertices have no common sheet gets a vertex at the
/// corner where three sheets meet. Positions are in voxels. The mesh stays closed and 2-manifold.
/// @param sheets  one for each vertex; grows with the mesh
void insertFeatures(IndexMesh& mesh, std::vector<VertexSheets>& sheets, const Progress& progress);

/// Repairs triangles that are turned over in their sheet or have no area there. Such triangles
/// arise where vertices of neighbouring cells coincide or have exchanged their order. The repair
/// flips mesh edges, then removes vertices from the triangles; these vertices remain in the list
/// without sheets. The surface stays in place and 2-manifold.
/// @param longest  longest side of a triangle after a removal, voxels. Longer triangles along a
/// curved edge of the solid cut through it.
void unfoldSheets(IndexMesh& mesh, std::vector<VertexSheets>& sheets, const Progress& progress,
                  double longest = std::numeric_limits<double>::infinity());

}  // namespace levelset
