#pragma once

#include <cstddef>
#include <numbers>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

namespace levelset {

struct FrontMeshOptions {
  /// Largest target length of edges, world units, at least one voxel; 0: 16 voxels. Edges reach
  /// about twice the target.
  double edgeLength = 0;
  /// Angle between the normals at the ends of an edge, radians, in (0, 1]. Edges are shorter where
  /// the surface bends more, but not below one voxel. A sphere loses 3/8 angle² of its volume.
  double angle = 20 * std::numbers::pi / 180;
  Progress progress = {};
};

struct BandFrontMesh {
  TriMesh mesh;                ///< in world coordinates
  std::size_t components = 0;  ///< components of the surface
  std::size_t uniform = 0;     ///< components that have the triangles of marching cubes
  std::size_t filled = 0;      ///< triangles that fill holes the fronts left
};

/// Converts the zero set to a mesh of nearly equilateral triangles by an advancing front
/// [Schreiner06]. The vertices lie on the zero set of the tricubic interpolant. Edge lengths follow
/// from the curvature; they change by at most 0.25 per unit of length along the surface. A
/// component gets the mesh of bandToMesh() if its front does not close, or if area, volume or Euler
/// characteristic show that the front is another surface. The mesh is closed, 2-manifold and faces
/// outwards.
/// @throws InvalidInput if the band is empty or has no zero crossing or is an open surface
/// @throws UsageError if an option is outside its range
/// @throws Cancelled
[[nodiscard]] BandFrontMesh bandToFrontMesh(const NarrowBand& band,
                                            const FrontMeshOptions& options = {});

}  // namespace levelset
