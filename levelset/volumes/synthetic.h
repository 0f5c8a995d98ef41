#pragma once

#include "levelset/progress.h"
#include "levelset/volumes/volume.h"

/// Volumes from formulas, on the cube [−1, 1]³ with grid points on its border, and a filter.
namespace levelset {

/// Samples the test signal of Marschner and Lobb, with fM = 6 and α = 0.25 [MarschnerLobb94]:
/// ρ = (1 − sin(πz/2) + α (1 + cos(2π fM cos(π r/2)))) / (2 (1 + α)), r = √(x² + y²). Its values
/// lie in [0, 1], and its customary isovalue is 0.5.
/// @param size  number of grid points along each axis, at least 2; 41 in the source
/// @throws UsageError for a smaller size; ResourceLimit
[[nodiscard]] Volume marschnerLobb(int size, std::size_t maxMemory = kNoMemoryLimit);
/// The signal itself, at any position.
[[nodiscard]] double marschnerLobbAt(const Imath::V3d& position);

/// Samples radius − |p|: the distance to a sphere around the origin, positive inside.
/// @throws as marschnerLobb(); UsageError also for a radius that is not positive
[[nodiscard]] Volume sphereVolume(int size, double radius, std::size_t maxMemory = kNoMemoryLimit);

/// Samples the distance to a torus around the z axis, positive inside.
/// @param radius,tube  radii of the circle and of the tube around it, > 0
/// @throws as sphereVolume()
[[nodiscard]] Volume torusVolume(int size, double radius, double tube,
                                 std::size_t maxMemory = kNoMemoryLimit);

struct BlurOptions {
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Convolves a volume with a Gaussian, cut off at four standard deviations. Values beyond the
/// border equal those on it. The result has the type f32.
/// @param sigma  standard deviation, world units, > 0
/// @throws UsageError for another sigma; InvalidInput for axes that are not perpendicular;
///         ResourceLimit; Cancelled
[[nodiscard]] Volume blurred(const Volume& volume, double sigma, const BlurOptions& options = {});

}  // namespace levelset
