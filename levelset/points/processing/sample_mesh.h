#pragma once

#include <optional>

#include "levelset/mesh.h"
#include "levelset/points/point_cloud.h"

namespace levelset {

struct SampleOptions {
  std::optional<std::size_t> count = {};  ///< number of points; empty: `spacing` is given
  /// Distance that neighbours would have in a hexagonal lattice, world units; empty: `count` is
  /// given.
  std::optional<double> spacing = {};
  bool isBlueNoise = true;  ///< false: independent points, uniform by area
  double noise = 0;         ///< standard deviation of each coordinate, world units
  bool hasNormals = true;   ///< true: the points keep the normals of their triangles
  std::uint64_t seed = 1;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Places points on the surface of a mesh. Noise moves them off the surface; normals stay those of
/// the surface. With blue noise, points have similar distances to their neighbours: they are chosen
/// from five times as many independent points [Yuksel15].
/// @throws UsageError for options outside their range
/// @throws InvalidInput for a mesh without area
/// @throws ResourceLimit, Cancelled
[[nodiscard]] PointCloud sampleMesh(const TriMesh& mesh, const SampleOptions& options);

}  // namespace levelset
