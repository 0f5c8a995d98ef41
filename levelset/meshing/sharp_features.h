#pragma once

// Edges and corners between the vertices of a mesh. Internal header of levelset: public headers must not include it.

#include <array>
#include <cmath>
#include <vector>

#include "levelset/meshing/cell_surface.h"
#include "levelset/progress.h"

namespace levelset {

/// The unit normals of the sheets of the surface that meet at a vertex: one on a smooth part, two
/// on an edge, three at a corner. None: nothing is known there.
struct VertexSheets {
  static constexpr std::size_t kMost = 4;
  std::uint8_t count = 0;
  std::array<openvdb::Vec3f, kMost> normal = {};
};

[[nodiscard]] inline openvdb::Vec3d sheetNormal(const VertexSheets& sheets, std::size_t i) {
  return openvdb::Vec3d(sheets.normal[i]);
}

/// Sheets whose normals are less than that far apart are one.
inline constexpr double kOneSheetCosine = 0.9;

/// Does the segment `to`, from a vertex whose sheet has normal `n` to one with `sheets`, run in
/// that sheet? The chord of a round face is at right angles to the mean of the normals at its ends.
[[nodiscard]] inline bool isInSheet(const openvdb::Vec3d& n, const openvdb::Vec3d& to,
                                    const VertexSheets& sheets) {
  constexpr double kOff = 0.03;  // voxels
  if (std::abs(n.dot(to)) < kOff) return true;
  for (std::size_t i = 0; i < sheets.count; ++i) {
    const openvdb::Vec3d other = sheetNormal(sheets, i);
    if (other.dot(n) > kOneSheetCosine && std::abs((n + other).dot(to)) < 2 * kOff) return true;
  }
  return false;
}

/// How well the planes are known that a vertex was fitted to.
struct SheetQuality {
  double misfit = 0;  ///< largest distance of the vertex to one of them, voxels
  double bend = 1;    ///< largest second difference of the values that tell them, voxels
};

/// The vertices near which edges of the solid are sure: some vertex with several sheets is there,
/// the surface around it lies in these, and each of them is much flatter somewhere than a round
/// surface that turns as far. Smooth surfaces have none, whatever their curvature, and nor have
/// edges that are rounded off by a voxel or more: the values beside them are not those of the
/// planes. Those vertices are put where the planes of their sheets meet as the flattest places near
/// them tell these: an edge bends the values at the grid points next to it.
/// @param field    whose zero set the mesh is
/// @param sheets   one for each vertex
/// @param quality  one for each vertex
[[nodiscard]] std::vector<bool> confirmFeatures(IndexMesh& mesh, const openvdb::FloatGrid& field,
                                                std::vector<VertexSheets>& sheets,
                                                const std::vector<SheetQuality>& quality,
                                                const Progress& progress);

/// How far one end of a segment between two vertices is from the nearest sheet through the other,
/// voxels: 0 when the segment runs in a sheet of either.
[[nodiscard]] double sheetGap(const openvdb::Vec3d& from, const VertexSheets& fromSheets,
                              const openvdb::Vec3d& to, const VertexSheets& toSheets);

/// Makes mesh edges follow the edges of the solid, after Kobbelt et al. [Kobbelt01]: a mesh edge
/// that cuts across one is flipped to run along it, or gets a vertex where the sheets of its ends
/// meet; a triangle whose vertices have no sheet in common gets one at the corner where three
/// sheets meet. Positions are in voxels. The mesh stays closed and 2-manifold.
/// @param sheets  one for each vertex; grows with the mesh
void insertFeatures(IndexMesh& mesh, std::vector<VertexSheets>& sheets, const Progress& progress);

/// Mends triangles that are turned over in their sheet or without area there, where vertices of
/// neighbouring cells have changed places or meet: by flips of mesh edges, then by leaving vertices
/// out, which stay behind without sheets. The surface stays where it is and 2-manifold.
void unfoldSheets(IndexMesh& mesh, std::vector<VertexSheets>& sheets, const Progress& progress);

}  // namespace levelset
