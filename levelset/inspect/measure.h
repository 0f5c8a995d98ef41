#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct Measurement {
  double volume = 0;    ///< of the solid, cavities subtracted, world units³
  double area = 0;      ///< of all its surfaces, world units²
  Imath::Box3d bounds;  ///< of the zero set
  std::size_t activeVoxels = 0;
  double voxelSize = 0, halfWidth = 0;
  std::size_t components = 0, shells = 0, cavities = 0;
  long euler = 0;                       ///< V − E + F of the surface: 2 per sphere, 0 per torus
  Imath::V3d centroid = Imath::V3d(0);  ///< of the solid, world; zero when the volume is
  /// Of the solid with density 1 about its centroid, along the world's axes, world units⁵.
  Imath::M33d inertia = Imath::M33d(0.0);
  double meanCurvature = 0;  ///< ∫ (k1 + k2) / 2 dA, world units: 4πR for a sphere
};

/// By quadrature on the zero set of the tricubic interpolant: on smooth surfaces better than third
/// order in the voxel size, along edges second, as a grid shows them. Sums run in a fixed order.
/// An empty band measures zero.
/// @throws InvalidInput for an open surface
[[nodiscard]] Measurement measure(const NarrowBand& solid, const Progress& progress = {});

/// The same figures of a triangle mesh, exact for its flat triangles. `components` counts connected
/// surfaces that face outwards. Volume, centroid and inertia mean something for a closed mesh only;
/// the curvature is that of its edges, half the length times the angle [Steiner40]. Seams of
/// attributes count as closed (withoutSeams).
[[nodiscard]] Measurement measure(const TriMesh& mesh, const Progress& progress = {});

/// Is every edge shared by exactly two triangles that run along it in opposite directions, and
/// every vertex the centre of one fan? Seams of attributes count as closed (withoutSeams).
struct Manifoldness {
  std::size_t boundaryEdges = 0, nonManifoldEdges = 0, misorientedEdges = 0,
              nonManifoldVertices = 0;
  [[nodiscard]] bool isClosedManifold() const {
    return boundaryEdges + nonManifoldEdges + misorientedEdges + nonManifoldVertices == 0;
  }
};
[[nodiscard]] Manifoldness manifoldness(const TriMesh& mesh);

}  // namespace levelset
