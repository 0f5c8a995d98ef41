#pragma once

// Internal header of levelset: public headers must not include it.

#include <limits>
#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/grids/band_blocks_vdb.h"

namespace levelset::flow {

/// Widths around the surface, in voxels.
/// - kFlowWidth: distances are computed up to this distance on each side.
/// - kFlowCore: φ_t is computed from differences of φ in the core, the grid points up to this
///   distance.
/// - kFlowLeader: from this distance on, a grid point follows a leader, its closest point on the
///   level set |φ| = kFlowLeader. The rate φ_t of the grid point is that at the leader plus a
///   constant: the difference in curvature of their level sets at the last redistancing. So all
///   level sets move with the surface.
/// - kFlowTravel: the surface may move by this distance before the band is redistanced.
/// The differences read values up to 2.83 voxels away. Distances must extend that far beyond the
/// core. Otherwise the rates of the outermost leaders are wrong, and long steps transport the error
/// to the surface (test CurvatureFlow.IsExactInLongSteps). The level set of the leaders must also
/// be 2.83 voxels from the surface after the surface has moved by kFlowTravel. With 2.2 voxels
/// instead, a ball with a radius of 32 voxels lost a thousandth of a voxel at each redistancing.
inline constexpr double kFlowWidth = 8.1, kFlowCore = 5.2, kFlowLeader = 4.3, kFlowTravel = 1.5;

/// φ of a solid in voxels during the flow, on a set of leaf blocks that stays the same until the
/// next redistancing.
class CurvatureState {
 public:
  /// @param distance  band of half width kFlowWidth, world units
  CurvatureState(const openvdb::FloatGrid& distance, const std::optional<Mask>& mask);

  Field value;  ///< φ, voxels

  [[nodiscard]] const BandBlocks& blocks() const { return blocks_; }
  /// φ after the last redistancing, voxels.
  [[nodiscard]] const Field& start() const { return start_; }
  /// Mask weights of the grid points, which multiply φ_t; empty: all weights are 1.
  [[nodiscard]] const Field& weights() const { return weights_; }

  /// Computes the rate φ_t = weight (κ − shift) |∇φ| at all grid points of the band.
  /// @param field  φ in voxels
  /// @param shift  constant subtracted from the curvature, voxels⁻¹
  void evaluate(const Field& field, double shift, Field& rate) const;

  /// Writes `value` to a copy of the band that the state was constructed from.
  [[nodiscard]] openvdb::FloatGrid::Ptr toGrid(const openvdb::FloatGrid& distance) const;

 private:
  /// Grid point whose rate φ_t follows that at its leader, its closest point on |φ| = kFlowLeader.
  /// The rate at the leader is interpolated from the corners of the grid cell that contains it.
  struct Follower {
    std::uint16_t gridPoint = 0;
    /// Rate of the grid point minus that at its leader, at the last redistancing.
    float rateDifference = 0;
    /// Corners of the leader's cell, numbered by BandBlocks::find, and their trilinear weights.
    std::array<std::uint32_t, 8> corners{};
    std::array<float, 8> weights{};
  };

  /// Sums k1 + k2 and k1² + k2² of the principal curvatures of the level set through each grid
  /// point, voxels⁻¹ and voxels⁻². Zero outside the core and near the surface, where they are not
  /// used.
  struct Bending {
    Field sums, squares;
  };
  void findCore(std::size_t i, PaddedBlock& block, Bending& bending);
  void findFollowers(std::size_t i, PaddedBlock& block, const Bending& bending);

  BandBlocks blocks_;
  Field start_, weights_;
  std::vector<BandBlocks::Mask> core_;
  std::vector<std::vector<Follower>> followers_;
  /// Rates φ_t of the grid points in `followers_`, for each block. A member, so that evaluate()
  /// reuses its memory.
  mutable std::vector<std::vector<float>> followed_;
};

/// Least distance from the surface, in voxels, of the level sets that had |φ| ≥ kFlowLeader at the
/// last redistancing. The band is redistanced when one of these level sets comes closer. Where the
/// surface is at rest, such as a ball with preserved volume, other level sets still move. Without
/// redistancing they would in time form a second zero set.
inline constexpr double kFlowNearest = 1;

/// Sums and extrema over the grid points beside the zero set, |φ| < 1 voxel; `clear` is over all
/// grid points of the band. Rates are φ_t, voxels⁻¹.
struct NearSurface {
  double count = 0;
  double fastest = 0;    ///< largest |rate|
  double displaced = 0;  ///< largest displacement of the surface since redistancing, voxels
  double squares = 0;    ///< sum of squared rates
  double rates = 0;      ///< sum of rates
  double weights = 0;    ///< sum of mask weights
  double levels = 0, levelSquares = 0, levelRates = 0;  ///< sums of φ, φ² and φ times the rate
  /// Time, voxels², until a level set with |φ| ≥ kFlowLeader at the last redistancing comes within
  /// kFlowNearest of the zero set at its current rate. Infinite: none approaches it.
  double clear = std::numeric_limits<double>::infinity();
  /// Returns the rms deviation of the rate from its mean over the surface. The level sets beside
  /// the surface have other curvatures, so the part of the rate that is linear in φ is subtracted.
  [[nodiscard]] double unevenness() const;
  NearSurface& operator+=(const NearSurface& other);
};
[[nodiscard]] NearSurface measureNearSurface(const CurvatureState& state, const Field& rate);

/// Inside volume of the active grid points, voxels³, and area of the surface weighted by the mask,
/// voxels². If φ rises by δ times the mask weight at each grid point, the volume decreases by area
/// × δ. The volume sums, over unit cubes about grid points, the part behind the tangent plane,
/// corrected for curvature.
struct VolumeAndArea {
  double volume = 0, area = 0;
  VolumeAndArea& operator+=(const VolumeAndArea& other);
};
/// Computes the volume and the weighted area of the state.
/// @param rate  φ_t, as evaluate() computes it for the state with this `shift`
[[nodiscard]] VolumeAndArea volumeAndAreaOf(const CurvatureState& state, const Field& rate,
                                            double shift);
/// Returns the number of inactive inside grid points, including those in tiles. The flow does not
/// change them.
[[nodiscard]] double inactiveVolume(const openvdb::FloatTree& tree);

}  // namespace levelset::flow
