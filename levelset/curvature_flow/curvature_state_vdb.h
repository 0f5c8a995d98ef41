#pragma once

// Internal header of levelset: public headers must not include it.

#include <limits>
#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/grids/band_blocks_vdb.h"

namespace levelset::flow {

/// Widths around the surface, in voxels.
/// - kFlowWidth: distances are computed up to here on each side.
/// - kFlowCore: the rate is computed up to here.
/// - kFlowLeader: from here on a grid point follows a leader, the closest point of this level set.
///   Its rate is that of its leader plus the difference that parallel surfaces have there at the
///   start. So all level sets move along with the surface.
/// - kFlowTravel: the surface may move this far before redistancing.
/// Differences reach 2.83 voxels along diagonals. Distances must extend that far beyond the core.
/// Otherwise the rates that follow its outermost grid points are wrong, and long steps carry the
/// error to the surface (CurvatureFlow.IsExactInLongSteps). The level set of the leaders must also
/// be that far from the surface after its travel. With 2.2 instead, a ball of 32 voxels lost a
/// thousandth of a voxel at each redistancing.
inline constexpr double kFlowWidth = 8.1, kFlowCore = 5.2, kFlowLeader = 4.3, kFlowTravel = 1.5;

/// φ of a solid in voxels during the flow, on blocks that stay fixed until redistancing.
class CurvatureState {
 public:
  /// @param distance  a band of half width kFlowWidth
  CurvatureState(const openvdb::FloatGrid& distance, const std::optional<Mask>& mask);

  Field value;

  [[nodiscard]] const BandBlocks& blocks() const { return blocks_; }
  [[nodiscard]] const Field& start() const { return start_; }
  /// Weight of each grid point's motion; empty: all weights are 1.
  [[nodiscard]] const Field& weights() const { return weights_; }

  /// Computes φ_t at all grid points of the band: weight (κ − shift) |∇φ|.
  void evaluate(const Field& field, double shift, Field& rate) const;

  /// Writes `value` to a copy of the band that the state was constructed from.
  [[nodiscard]] openvdb::FloatGrid::Ptr toGrid(const openvdb::FloatGrid& distance) const;

 private:
  /// Grid point that takes its rate from the corners of the cell in which its leader lies.
  struct Follower {
    std::uint16_t gridPoint = 0;
    float rateDifference = 0;                ///< rate of the follower less that of its leader
    std::array<std::uint32_t, 8> corners{};  ///< BandBlocks::find
    std::array<float, 8> weights{};
  };

  /// Curvature of the level sets at grid points of the core: k1 + k2 and k1² + k2².
  struct Bending {
    Field sums, squares;
  };
  void findCore(std::size_t i, PaddedBlock& block, Bending& bending);
  void findFollowers(std::size_t i, PaddedBlock& block, const Bending& bending);

  BandBlocks blocks_;
  Field start_, weights_;
  std::vector<BandBlocks::Mask> core_;
  std::vector<std::vector<Follower>> followers_;
  /// Rates of the followers; a member to reuse its memory.
  mutable std::vector<std::vector<float>> followed_;
};

/// Least distance from the surface, in voxels, for level sets that began at kFlowLeader or beyond.
/// A nearer one forces redistancing. Where the surface stands still, as a ball with preserved
/// volume does, other level sets still move. In time they would form another zero set.
inline constexpr double kFlowNearest = 1;

/// Sums and extrema over the grid points beside the zero set, |φ| < 1.
struct NearSurface {
  double count = 0;
  double fastest = 0;    ///< largest |rate|
  double displaced = 0;  ///< largest displacement of the surface since redistancing, voxels
  double squares = 0;    ///< sum of squared rates
  double rates = 0;      ///< sum of rates
  double weights = 0;    ///< sum of weights
  double levels = 0, levelSquares = 0, levelRates = 0;  ///< sums of φ, φ² and φ times the rate
  /// Time until a level set from kFlowLeader or beyond comes within kFlowNearest at its current
  /// rate.
  double clear = std::numeric_limits<double>::infinity();
  /// Returns the rms deviation of the rate on the surface. Level sets beside it bend more or less
  /// than the surface, so the part of the rate that is linear in φ is subtracted.
  [[nodiscard]] double unevenness() const;
  NearSurface& operator+=(const NearSurface& other);
};
[[nodiscard]] NearSurface measureNearSurface(const CurvatureState& state, const Field& rate);

/// Volume in voxels³, and weighted area in voxels²: the volume lost when all values rise by one
/// voxel times their weight. The tangent plane at each grid point cuts its own cube; a correction
/// accounts for the bend of the surface.
struct VolumeAndArea {
  double volume = 0, area = 0;
  VolumeAndArea& operator+=(const VolumeAndArea& other);
};
/// Computes the volume and the weighted area of the state.
/// @param rate  rate that evaluate() returned for the state with this `shift`
[[nodiscard]] VolumeAndArea volumeAndAreaOf(const CurvatureState& state, const Field& rate,
                                            double shift);
/// Counts the inside grid points that are not active in the blocks of a tree: no step changes them.
[[nodiscard]] double inactiveVolume(const openvdb::FloatTree& tree);

}  // namespace levelset::flow
