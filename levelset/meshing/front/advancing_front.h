#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/meshing/front/front_surface.h"
#include "levelset/progress.h"

namespace levelset {

/// Mesh of an advancing front.
struct FrontMesh {
  std::vector<Imath::V3d> positions;
  std::vector<Imath::V3d> normals;  ///< unit normals of the surface
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::size_t filled = 0;  ///< triangles that fill holes the front left
  bool isClosed = false;   ///< no front is left, but for the borders of the surface
};

struct AdvancingFrontOptions {
  double longest = 0;                 ///< limit of FrontSurface::edgeLength() and of given edges
  std::size_t expectedTriangles = 0;  ///< about; a front with many more stops open
  Progress progress = {};
};

/// Meshes one component of a surface by an advancing front [Schreiner06]. The front starts
/// at a triangle. An edge of the front gets a triangle whose third vertex is a vertex of the front
/// nearby, or a new one: a predicted position that is projected onto the surface. A vertex on
/// another part of the front splits the front or merges two fronts. Edges along a border of the
/// surface get no triangle. Each other edge has one triangle on each side, also if the front gets
/// stuck.
/// @param start  position near the surface
/// @throws Cancelled
[[nodiscard]] FrontMesh advanceFront(const FrontSurface& surface, const Imath::V3d& start,
                                     const AdvancingFrontOptions& options);

/// Closed loops of edges from which a front starts.
struct FrontLoops {
  std::vector<Imath::V3d> positions, normals;     ///< vertices, and unit normals there
  std::vector<std::vector<std::uint32_t>> loops;  ///< the surface lies to the left of each edge
};

/// Meshes the part of a surface within loops. The vertices of the loops are the first of the mesh.
/// The edges of the loops get one triangle.
/// @throws Cancelled
[[nodiscard]] FrontMesh advanceFront(const FrontSurface& surface, const FrontLoops& start,
                                     const AdvancingFrontOptions& options);

}  // namespace levelset
