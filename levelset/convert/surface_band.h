#pragma once

#include <cstddef>

#include "levelset/mesh.h"
#include "levelset/narrow_band.h"
#include "levelset/progress.h"

/// A band about a surface that has a border: a base for patches, not a solid.
namespace levelset {

/// Voxels: a tricubic at the surface reads as far as 3.5.
inline constexpr double kLeastSurfaceHalfWidth = 4;

struct SurfaceBandOptions {
  double halfWidth = 5;  ///< voxels, at least kLeastSurfaceHalfWidth
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

struct SurfaceBandResult {
  NarrowBand band;  ///< isOpenSurface()
  std::size_t borderEdges = 0;
  std::size_t droppedTriangles = 0;  ///< without area, or repeated exactly
  std::size_t cutVoxels = 0;  ///< between two parts of the surface, where their sides contradict
};

/// Distances to an open mesh whose triangles face one way, positive on the side that they face: the
/// sign is that of the closest face, and about edges and vertices of their pseudonormals, weighted
/// by angle [Baerentzen05]. Beyond the border the surface goes on straight for 3.5 voxels, so
/// that interpolation is sound up to the border however the surface lies; there the band is cut
/// off, and beyond it nothing is active. How far beyond the border a place lies is kept
/// (BandSampler::beyondBorder), for what goes on so from both sides of a slit meets. So it is where
/// the front of one part meets the back of another, at half their distance.
/// @param mesh       vertices at equal positions count as one
/// @param voxelSize  world units, positive and finite; grid points sit at its integer multiples
/// @throws UsageError for a voxel size or half width out of range; InvalidInput for a mesh that
///         meshToBand would not take, one without a border, edges with three faces, and edges where
///         two faces are turned against each other (a Möbius strip has some however it is turned);
///         ResourceLimit; Cancelled
[[nodiscard]] SurfaceBandResult surfaceBand(const TriMesh& mesh, double voxelSize,
                                            const SurfaceBandOptions& options = {});

}  // namespace levelset
