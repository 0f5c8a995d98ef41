#pragma once

// Internal header of levelset: includes OpenVDB, so include it from .cpp files only.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/meshing/cells/cell_surface.h"
#include "levelset/progress.h"
#include "levelset/vdb.h"

namespace levelset {

/// Mesh and those of its edges at which the solid has creases. Index space.
struct CreasedMesh : IndexMesh {
  std::vector<std::array<std::uint32_t, 2>> creases;  ///< pairs of vertices, in ascending order
};

/// Moves the vertices of a mesh near its creases to the places that the distances of the solid
/// determine, and divides its triangles there. Each face beside a crease is a polynomial that is
/// fitted to the distances of the grid points whose closest point lies on it (FaceFit). Vertices on
/// a crease move to the intersection of the faces, those beside it onto their face. Where a face
/// has no fit, vertices stay.
/// @param mesh  near the zero set, within about 0.2 voxel
/// @throws ResourceLimit, Cancelled
[[nodiscard]] CreasedMesh fitCreases(CreasedMesh mesh, const openvdb::FloatGrid& grid,
                                     std::size_t maxMemory, const Progress& progress);

}  // namespace levelset
