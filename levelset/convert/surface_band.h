#pragma once

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// Band of a surface that has a border: a base for patches, not a solid.
namespace levelset {

/// Minimum half width, voxels: tricubic interpolation at the surface reads up to 3.5 voxels away.
inline constexpr double kMinSurfaceHalfWidth = 4;

struct SurfaceBandOptions {
  double halfWidth = 5;  ///< voxels, at least kMinSurfaceHalfWidth
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct SurfaceBandResult {
  NarrowBand band;  ///< isOpenSurface()
  std::size_t borderEdges = 0;
  std::size_t droppedTriangles = 0;  ///< triangles without area and exact duplicates
  /// Voxels removed where the front of one part of the surface meets the back of another.
  std::size_t removedVoxels = 0;
};

/// Computes distances to an open, consistently oriented mesh, positive on the side that the
/// triangles face. The sign is that of the closest face; at edges and vertices, that of the
/// angle-weighted pseudonormal [Baerentzen05].
///
/// Beyond the border the band extends the surface straight for 3.5 voxels. Interpolation is thus
/// valid up to the border in any orientation. The band ends there and nothing is active further
/// out. The extensions of both sides of a slit overlap, so the band stores the distance of each
/// point beyond the border (BandSampler::beyondBorder). The band also ends halfway between two
/// parts where the front of one faces the back of the other.
/// @param mesh  vertices at equal positions count as one
/// @param voxelSize  world units, positive and finite; grid points lie at its integer multiples
/// @throws UsageError for a voxel size or half width out of range
/// @throws InvalidInput for a mesh that meshToBand refuses or a mesh without a border. Also throws
///         for an edge with three faces or with two faces of opposite orientations. Any Möbius
///         strip has such an edge.
/// @throws ResourceLimit, Cancelled
[[nodiscard]] SurfaceBandResult surfaceBand(const TriMesh& mesh, double voxelSize,
                                            const SurfaceBandOptions& options = {});

}  // namespace levelset
