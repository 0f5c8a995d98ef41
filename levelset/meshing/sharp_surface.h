#pragma once

#include "levelset/meshing/cell_surface.h"

namespace levelset {

/// A vertex on an edge or corner of the solid, and the faces that meet there.
struct SharpFeature {
  std::uint32_t vertex = 0;
  std::array<openvdb::Vec3d, 4> normals;  ///< outward, unit length
  std::size_t normalCount = 0;            ///< at least 2
  double misfit = 0;                      ///< largest distance of the vertex to a face, voxels
};

struct SharpMesh : IndexMesh {
  std::vector<SharpFeature> features;  ///< by rising vertex
};

/// The zero set in index space with the edges and corners that the field implies: one vertex for
/// each polygon of a cell, one quadrilateral for each crossed edge [Ju02, Nie04]. Closed and
/// 2-manifold as the uniform mesh is.
[[nodiscard]] SharpMesh sharpSurface(const CellSurface& surface, const openvdb::FloatGrid& grid);

}  // namespace levelset
