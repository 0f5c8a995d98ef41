#pragma once

// For the .cpp files of levelset/csg only.

#include <array>
#include <memory>
#include <span>
#include <unordered_map>

#include "levelset/csg/blend.h"
#include "levelset/geometry/search/point_search.h"
#include "levelset/vdb.h"

namespace levelset::solids {

/// Weight of each grid point in the flow: 1 near the seam curve, falling smoothly to 0 at the
/// distance `radius` from it.
class SeamWeights {
 public:
  using Block = std::array<float, 512>;
  /// @param curve   points of the seam curve in index space
  /// @param radius  voxels
  SeamWeights(std::span<const openvdb::Vec3d> curve, double radius);
  /// Returns the weights of the leaf block at `origin`; null if all are zero. Not thread-safe.
  const Block* at(const openvdb::Coord& origin);
  /// Computes the weights of the leaf blocks at `origins` in parallel and keeps them for at().
  void prepare(const std::vector<openvdb::Coord>& origins);

 private:
  [[nodiscard]] std::unique_ptr<Block> make(const openvdb::Coord& origin) const;

  PointSearch curve_;
  double radius_;
  std::unordered_map<openvdb::Coord, std::unique_ptr<Block>, std::hash<openvdb::Coord>> blocks_;
};

struct SeamFlow {
  double radius = 0;  ///< radius of the rounding, voxels
  BlendSide side = BlendSide::Both;
};

/// Integrates φ_t = D (κ − clamp(κ, ±1/radius)) |∇φ| over one step, with the weight D, κ = k1 + k2
/// and φ in voxels. Only points with |κ| above 1/radius move, so the flow stops when there are
/// none. Uses a first-order Runge-Kutta-Legendre scheme [Meyer14] with as many stages as `dt`
/// requires for stability.
/// @return largest change of a value within one voxel of the zero set, voxels
double seamStep(openvdb::FloatTree& field, SeamWeights& weights, const SeamFlow& flow, double dt);

/// Returns the largest |φ_t| within one voxel of the zero set, for φ in voxels.
[[nodiscard]] double seamSpeed(openvdb::FloatTree& field, SeamWeights& weights,
                               const SeamFlow& flow);

}  // namespace levelset::solids
