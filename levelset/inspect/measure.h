#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"

namespace levelset {

struct Measurement {
  double volume = 0;    ///< of the solid, cavities subtracted, world units³
  double area = 0;      ///< of all its surfaces, world units²
  Imath::Box3d bounds;  ///< of the zero set
  std::size_t activeVoxels = 0;
  double voxelSize = 0, halfWidth = 0;
  std::size_t components = 0, shells = 0, cavities = 0;
  long euler = 0;  ///< V − E + F of the surface: 2 per sphere, 0 per torus
};

/// Second order in the voxel size; sums run in a fixed order.
/// An empty band measures zero.
[[nodiscard]] Measurement measure(const NarrowBand& solid);

/// The same figures of a triangle mesh. `components` counts connected surfaces that face outwards.
[[nodiscard]] Measurement measure(const TriMesh& mesh);

/// Is every edge shared by exactly two triangles that run along it in opposite directions, and
/// every vertex the centre of one fan?
struct Manifoldness {
  std::size_t boundaryEdges = 0, nonManifoldEdges = 0, misorientedEdges = 0,
              nonManifoldVertices = 0;
  [[nodiscard]] bool isClosedManifold() const {
    return boundaryEdges + nonManifoldEdges + misorientedEdges + nonManifoldVertices == 0;
  }
};
[[nodiscard]] Manifoldness manifoldness(const TriMesh& mesh);

}  // namespace levelset
