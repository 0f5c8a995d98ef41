#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/distance/propagate.h"
#include "levelset/distance/surface/closest_point.h"
#include "levelset/distance/surface/zero_set.h"

namespace levelset::eikonal {

/// Refinement of a surface point decreases its distance from the grid point by at most this, in
/// voxels.
inline constexpr double kPolishGain = 0.5;

/// Point of the zero set, in index space, and its distance from a grid point, voxels.
struct Closest {
  openvdb::Vec3d point;
  double distance = 0;
  void takeIfNearer(const Closest& other) {
    if (other.distance < distance) *this = other;
  }
};

/// Finds the closest point of the zero set for a grid point. Refines the nearest surface points
/// that NearestPoints found for the grid point and for its six neighbours. One per thread.
class Polisher {
 public:
  explicit Polisher(const ZeroSet& surface)
      : cache_(*surface.interpolated), points_(surface.points), patches_(surface.patches) {}

  /// Computes the closest points of some grid points of a block together, for the calls of
  /// closest() that follow on this block. They give the same results without it, but take longer.
  void prepare(const NearestPoints::Block& block, const NearestPoints::Mask& gridPoints);

  /// Returns the interpolation error of distances to the surface beside a surface point, voxels.
  [[nodiscard]] double interpolationError(std::uint32_t point) const;

  /// Returns the closest point for the grid point number `n` of a block. Fastest if all grid points
  /// of a block follow each other.
  /// @pre the grid point has a nearest surface point
  [[nodiscard]] Closest closest(const NearestPoints::Block& block, openvdb::Index n);

 private:
  /// Copies the positions of the surface points that the grid points of a block refer to, and finds
  /// the grid points beside which another part of the surface is nearest.
  void load(const NearestPoints::Block& block);
  /// Finds the closest point of the zero set to x near a surface point. The search starts on the
  /// sharp patches (triangles near edges) if the surface point lies on them, else on the
  /// interpolant. If the point that it finds lies in the domain of the other of the two, the search
  /// continues on that one.
  Closest polish(const openvdb::Vec3d& x, std::uint32_t point);
  /// Continues polish() after the two Newton steps of `foot` on the interpolant.
  Closest polishFrom(const Foot& foot, const openvdb::Vec3d& x, std::uint32_t point);
  /// Finds the foot point with Newton's method from `start`; returns `start` if that fails. Far
  /// inside a solid, a large part of the surface is almost equally near. The foot point may then be
  /// far from `start`, so a search that leaves the block restarts at that position.
  Closest polishOnInterpolant(const openvdb::Vec3d& x, openvdb::Vec3d start);
  [[nodiscard]] bool isOnSurface(const openvdb::Vec3d& point);

  // A block with a border of one grid point on each side.
  static constexpr int kSide = 10;
  static constexpr std::size_t slot(int x, int y, int z) {
    return static_cast<std::size_t>(((x + 1) * kSide + y + 1) * kSide + z + 1);
  }

  DenseBlockCache cache_;
  const NearestPoints::Block* loaded_ = nullptr;  ///< block of the tables below
  /// Nearest surface points of the block and of its border, relative to the block, one array for
  /// each axis; NaN where there is none. The edges and corners of the border are not used.
  std::array<std::array<float, std::size_t{kSide} * kSide * kSide>, 3> nearest_;
  /// Grid points of the block with a neighbour whose nearest surface point may lie on another part
  /// of the surface.
  NearestPoints::Mask meetsOther_;
  const NearestPoints::Block* preparedBlock_ = nullptr;
  NearestPoints::Mask prepared_;          ///< grid points of that block with an entry in `feet_`
  std::array<std::uint16_t, 512> entry_;  ///< number of the entry, for each grid point
  std::vector<JetSearch> searches_;
  std::vector<Foot> feet_;
  const SurfacePoints& points_;
  const SharpPatches& patches_;
};

}  // namespace levelset::eikonal
