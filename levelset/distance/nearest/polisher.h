#pragma once

// Internal header of levelset: public headers must not include it.

#include "levelset/distance/nearest/propagate.h"
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

  /// Dense copies of the field, for other searches of the same thread.
  [[nodiscard]] DenseBlockCache& cache() { return cache_; }

  /// Call after blocks were deleted: a new block may have the address of the last one.
  void forgetBlock() { loaded_ = preparedBlock_ = nullptr; }

  /// Computes the closest points of some grid points of a block together, for closest(). This is
  /// faster than one after another, and gives the same bits.
  /// @pre the grid points have a nearest surface point
  void prepare(const NearestPoints::Block& block, const NearestPoints::Mask& gridPoints);

  /// Returns the interpolation error of distances to the surface beside a surface point, voxels.
  [[nodiscard]] double interpolationError(std::uint32_t point) const;

  /// Returns the closest point for the grid point number `n` of a block. Fastest if all grid points
  /// of a block follow each other. Valid until the next call.
  /// @pre the grid point has a nearest surface point
  [[nodiscard]] const Closest& closest(const NearestPoints::Block& block, openvdb::Index n);

 private:
  /// A grid point of a block, and a surface point near which its closest point may lie.
  struct Candidate {
    openvdb::Index n;
    std::uint32_t point;
  };

  /// Copies the positions of the surface points that the grid points of a block refer to, and finds
  /// the grid points beside which another part of the surface is nearest.
  void load(const NearestPoints::Block& block);
  /// Lists the surface points near which the closest point of a grid point may lie.
  void addCandidates(const NearestPoints::Block& block, openvdb::Index n);
  /// Finds the closest point of the zero set near the surface point of each candidate. A search
  /// starts on the sharp patches (triangles near edges) if the surface point lies on them, else on
  /// the interpolant. If the point that it finds lies in the domain of the other of the two, the
  /// search continues on that one.
  void polishCandidates();
  /// Finds the closest point near a surface point on the sharp patches.
  Closest polishOnPatches(const openvdb::Vec3d& x, std::uint32_t point);
  /// Finds the foot points of some candidates on the interpolant together.
  /// @param candidates  their numbers; empty afterwards
  void polishOnInterpolant(std::vector<std::size_t>& candidates);
  /// Finds the foot point with Newton's method from `start`; returns `start` if that fails. Far
  /// inside a solid, a large part of the surface is almost equally near. The foot point may then be
  /// far from `start`, so a search that leaves the block restarts at that position.
  /// @param known  result of the first search; null: not known
  Closest polishOnInterpolant(const openvdb::Vec3d& x, openvdb::Vec3d start,
                              const Foot* known = nullptr);
  [[nodiscard]] bool isOnSurface(const openvdb::Vec3d& point);

  // A block with a border of one grid point on each side.
  static constexpr int kSide = 10, kRow = 12;
  static constexpr std::size_t kSlots = std::size_t{kSide} * kSide * kRow;
  static constexpr std::size_t slot(int x, int y, int z) {
    return static_cast<std::size_t>(((x + 1) * kSide + y + 1) * kRow + z + 1);
  }

  DenseBlockCache cache_;
  const NearestPoints::Block* loaded_ = nullptr;  ///< block of the tables below
  /// Nearest surface points of the block and of its border, relative to the block, one array for
  /// each axis; NaN where there is none. The edges and corners of the border are not used.
  std::array<std::array<float, kSlots>, 3> nearest_;
  /// Grid points of the block with a neighbour whose nearest surface point may lie on another part
  /// of the surface.
  NearestPoints::Mask meetsOther_;
  const NearestPoints::Block* preparedBlock_ = nullptr;
  NearestPoints::Mask prepared_;      ///< grid points of that block with a value in `closest_`
  std::array<Closest, 512> closest_;  ///< results of prepare()
  std::vector<Candidate> candidates_;
  std::vector<JetSearch> searches_;  ///< one for each candidate
  std::vector<Closest> polished_;    ///< one for each candidate
  // Used by the functions that polish candidates; members to save allocations.
  std::vector<Foot> feet_;
  std::vector<std::size_t> slow_, group_;
  std::vector<FootSearch> slowSearches_;
  const SurfacePoints& points_;
  const SharpPatches& patches_;
};

}  // namespace levelset::eikonal
