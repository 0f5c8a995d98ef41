#pragma once

// For the .cpp files of levelset/solids only.

#include <array>
#include <memory>
#include <span>
#include <unordered_map>

#include "levelset/csg/blend.h"
#include "levelset/geometry/point_tree.h"
#include "levelset/vdb.h"

namespace levelset::solids {

/// How strongly a grid point takes part in the flow: 1 near the curve, smoothly 0 at `radius` from
/// it.
class SeamWeights {
 public:
  using Block = std::array<float, 512>;
  /// @param radius  voxels; keeps a view of the curve
  SeamWeights(std::span<const openvdb::Vec3d> curve, double radius);
  /// Weights of the leaf block at `origin`; null where all vanish. Not for several threads at once.
  const Block* at(const openvdb::Coord& origin);
  /// Makes the weights of these blocks, in parallel.
  void prepare(const std::vector<openvdb::Coord>& origins);

 private:
  [[nodiscard]] std::unique_ptr<Block> make(const openvdb::Coord& origin) const;

  eikonal::PointTree curve_;
  std::span<const openvdb::Vec3d> points_;
  double radius_;
  std::unordered_map<openvdb::Coord, std::unique_ptr<Block>, std::hash<openvdb::Coord>> blocks_;
};

struct SeamFlow {
  double radius = 0;  ///< voxels
  BlendSide side = BlendSide::Both;
};

/// One step of φ_t = D (κ − clamp(κ, ±1/radius)) |∇φ| on a field in voxels, κ = k1 + k2: only what
/// is bent more sharply than the radius moves, so the flow comes to rest when nothing is. Stable by
/// a Runge-Kutta-Legendre scheme of first order [Meyer14] in as many stages as `dt` asks for.
/// @return the largest change of a value within a voxel of the zero set
double seamStep(openvdb::FloatTree& field, SeamWeights& weights, const SeamFlow& flow, double dt);

/// Largest |φ_t| within a voxel of the zero set.
[[nodiscard]] double seamSpeed(openvdb::FloatTree& field, SeamWeights& weights,
                               const SeamFlow& flow);

}  // namespace levelset::solids
