#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct Measurement {
  double volume = 0;    ///< volume of the solid, cavities subtracted, world units³
  double area = 0;      ///< area of all its surfaces, world units²
  Imath::Box3d bounds;  ///< bounds of the zero set, world units
  std::size_t activeVoxels = 0;
  double voxelSize = 0, halfWidth = 0;
  std::size_t components = 0, surfaces = 0, cavities = 0;
  long euler = 0;  ///< Euler characteristic V − E + F of the surface: 2 per sphere, 0 per torus
  Imath::V3d centroid = Imath::V3d(0);  ///< centroid of the solid, world units; zero for zero
                                        ///< volume
  /// Inertia tensor of the solid with density 1 about its centroid, along the world axes, world
  /// units⁵.
  Imath::M33d inertia = Imath::M33d(0.0);
  double meanCurvature = 0;  ///< ∫ (k1 + k2) / 2 dA, world units: 4πR for a sphere
};

/// Measures a solid by quadrature on the zero set of the tricubic interpolant. The error is better
/// than third order in the voxel size on smooth surfaces, and second order along edges. Sums run in
/// a fixed order. An empty band measures zero.
/// @throws InvalidInput for an open surface
[[nodiscard]] Measurement measure(const NarrowBand& solid, const Progress& progress = {});

/// Measures a solid with sharp edges. Edges and corners are those of bandToExtendedMesh(). Beside
/// them, patches of second order replace the interpolant, which rounds them by half a voxel² of the
/// cross-section. A solid without edges has the same bits as in measure(). On rough surfaces, noise
/// is taken for edges.
/// @throws InvalidInput for an open surface
[[nodiscard]] Measurement measureSharp(const NarrowBand& solid, const Progress& progress = {});

/// Measures a triangle mesh, exactly for its flat triangles. `components` counts the connected
/// surfaces that face outwards. Volume, centroid and inertia are meaningful for a closed mesh only.
/// `meanCurvature` is the sum over the edges of half the length times the angle [Steiner40]. Seams
/// of attributes count as closed (withoutSeams).
[[nodiscard]] Measurement measure(const TriMesh& mesh, const Progress& progress = {});

/// Defects of a mesh. In a closed manifold, exactly two triangles share each edge and traverse it
/// in opposite directions. The triangles at each vertex form one fan. Seams of attributes count as
/// closed (withoutSeams).
struct Manifoldness {
  std::size_t boundaryEdges = 0, nonManifoldEdges = 0, misorientedEdges = 0,
              nonManifoldVertices = 0;
  [[nodiscard]] bool isClosedManifold() const {
    return boundaryEdges + nonManifoldEdges + misorientedEdges + nonManifoldVertices == 0;
  }
};
[[nodiscard]] Manifoldness manifoldness(const TriMesh& mesh);

}  // namespace levelset
