#pragma once

#include <cstddef>

#include "levelset/narrow_band.h"
#include "levelset/points/point_cloud.h"
#include "levelset/progress.h"

/// Solids from particles of a fluid: points inside a volume, without normals.
namespace levelset {

/// Surface around particles.
enum class ParticleKernel {
  Balls,       ///< union of balls about the particles
  Blobs,       ///< sum of Gaussians; a single particle is its ball [Blinn82]
  ZhuBridson,  ///< ball of the mean centre and the mean radius near each position [Zhu05]
  Anisotropic  ///< sum of kernels that are flattened like their neighbourhood [Yu13]
};

struct ParticleOptions {
  ParticleKernel kernel = ParticleKernel::Anisotropic;
  /// Radius of the ball of a particle, world units; 0: the radii of the cloud, or, without radii,
  /// 0.8 times the median distance between nearest neighbours.
  double radius = 0;
  /// Reach of a particle in its radii, from 1.5 to 10. Balls do not use it.
  double reach = 3;
  double halfWidth = 3;  ///< half width of the band, voxels, at least 1
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Makes the solid around particles: samples the field of a kernel on the grid, then computes exact
/// distances to its surface. Particles at equal positions count as one, with the largest radius.
/// @param voxelSize  world units; grid points lie at its integer multiples
/// @throws UsageError for options out of range
/// @throws InvalidInput for an empty cloud, or without a radius for a single particle; when the
///         voxel exceeds the largest radius
/// @throws NoSurface when no grid point lies inside
/// @throws ResourceLimit, Cancelled
[[nodiscard]] NarrowBand particlesToBand(const PointCloud& cloud, double voxelSize,
                                         const ParticleOptions& options = {});

}  // namespace levelset
