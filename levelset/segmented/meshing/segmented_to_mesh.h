#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/progress.h"
#include "levelset/segmented/segmented_field.h"

namespace levelset {

struct SegmentedMeshOptions {
  /// Moves vertices of junctions to the intersection of the interfaces that meet there, which are
  /// fitted by polynomials. Without it junctions are rounded by a fraction of a voxel.
  bool sharpensJunctions = true;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Labels on the two sides of a triangle.
struct TriangleSides {
  RegionLabel behind = kVoid, front = kVoid;  ///< the normal points to `front`
  friend bool operator==(const TriangleSides&, const TriangleSides&) = default;
};

/// Edge of the mesh where the interfaces of three regions meet.
struct JunctionEdge {
  std::array<std::uint32_t, 2> vertices;
  std::array<RegionLabel, 3> labels;  ///< ascending
};

/// Interfaces and sheets of a partition as one non-manifold mesh.
struct SegmentedMesh {
  TriMesh mesh;  ///< each vertex is shared by all regions that meet there
  /// For each triangle: front < behind, so solids face the void. Equal labels: the triangle belongs
  /// to a sheet. Triangles of a sheet that can be oriented face the same way.
  std::vector<TriangleSides> sides;
  std::vector<JunctionEdge> junctions;             ///< junction curves
  std::vector<std::array<std::uint32_t, 2>> rims;  ///< edges where a sheet ends: of one triangle
  /// Triangles of strips without width, ascending. Where more than three sheets meet in a line, as
  /// the pages of a book, strips along that line join junction curves of three sheets each.
  std::vector<std::uint32_t> strips;
  /// Vertices where four regions meet, and the ends of junction curves are joined.
  std::vector<std::uint32_t> junctionPoints;
};

/// Computes the interfaces of a segmented field. Cuts each cell of the grid into six tetrahedra
/// [Kuhn60] and each tetrahedron between the labels of its corners [Bloomenthal95]: an interface
/// crosses an edge where the distances to it balance; three regions meet at a point of a face, four
/// inside a tetrahedron. The surface of each region is closed. A region that owns no grid point
/// does not appear. Positions are second order in the voxel size, also at junctions.
///
/// A field with sheets stores the crossings of the edges of the tetrahedra. There a face with one
/// crossed edge holds a point of a rim, and one with three a point of a junction. Vertices on rims
/// and junctions lie on those of the mesh from which the field was made.
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SegmentedMesh segmentedToMesh(const SegmentedField& field,
                                            const SegmentedMeshOptions& options = {});

/// Returns the closed surface of a region, facing outwards, without unused vertices. Sheets inside
/// the region have no volume, and are left out.
[[nodiscard]] TriMesh regionSurface(const SegmentedMesh& mesh, RegionLabel region);
/// Computes the same surface without the rest of the mesh.
/// @throws as segmentedToMesh()
[[nodiscard]] TriMesh regionSurface(const SegmentedField& field, RegionLabel region,
                                    const SegmentedMeshOptions& options = {});

}  // namespace levelset
