#pragma once

// Internal header of levelset: public headers must not include it.

#include <limits>
#include <optional>

#include "levelset/fields/mask.h"
#include "levelset/grids/band_blocks_vdb.h"

namespace levelset::flow {

/// All in voxels: distances are made so far on each side; the rate is computed so far; from here on
/// it is that of the closest level within and the difference that parallel surfaces have there at
/// the start, so that all level sets go along with the surface, which may move by kFlowTravel
/// before distances are made again. The differences reach 2.83 along diagonals. So far must the
/// distances go beyond the core, or the rates that follow its outermost grid points are wrong and
/// long steps carry that to the surface (CurvatureFlow.IsExactInLongSteps). So far, too, is it from
/// the surface to the level where following begins: with 2.2, a ball of 32 lost a thousandth of a
/// voxel each time.
inline constexpr double kFlowWidth = 8.1, kFlowCore = 5.2, kFlowLeader = 4.3, kFlowTravel = 1.5;

/// φ of a solid in voxels while it flows, on blocks that hold still until distances are made again.
class CurvatureState {
 public:
  /// @param distance  a band of kFlowWidth
  CurvatureState(const openvdb::FloatGrid& distance, const std::optional<Mask>& mask);

  Field value;

  [[nodiscard]] const BandBlocks& blocks() const { return blocks_; }
  [[nodiscard]] const Field& start() const { return start_; }
  /// How strongly each grid point takes part; empty: all do fully.
  [[nodiscard]] const Field& weights() const { return weights_; }

  /// φ_t at all grid points of the band: weight (κ − shift) |∇φ|.
  void evaluate(const Field& field, double shift, Field& rate) const;

  /// Writes `value` to a copy of the band that this was made of.
  [[nodiscard]] openvdb::FloatGrid::Ptr toGrid(const openvdb::FloatGrid& distance) const;

 private:
  /// Takes its rate from the corners of the cell in which its leader lies.
  struct Follower {
    std::uint16_t gridPoint = 0;
    float rateDifference = 0;                ///< its rate less its leader's
    std::array<std::uint32_t, 8> corners{};  ///< BandBlocks::find
    std::array<float, 8> weights{};
  };

  /// How the level sets bend at grid points of the core: k1 + k2 and k1² + k2².
  struct Bending {
    Field sums, squares;
  };
  void findCore(std::size_t i, PaddedBlock& block, Bending& bending);
  void findFollowers(std::size_t i, PaddedBlock& block, const Bending& bending);

  BandBlocks blocks_;
  Field start_, weights_;
  std::vector<BandBlocks::Mask> core_;
  std::vector<std::vector<Follower>> followers_;
  mutable std::vector<std::vector<float>> followed_;  ///< their rates, kept for the memory
};

/// Until distances are made again no level set that began at kFlowLeader or further may come nearer
/// to the surface than this. Where the surface stands still, as a ball does that keeps its volume,
/// others still move: in time they would make a zero set of their own.
inline constexpr double kFlowNearest = 1;

/// What a field looks like beside its zero set, |φ| < 1.
struct NearSurface {
  double count = 0;
  double fastest = 0;    ///< |rate|
  double displaced = 0;  ///< how far the surface went since distances were made
  double squares = 0;    ///< sum of squared rates
  double rates = 0;      ///< sum of rates …
  double weights = 0;    ///< … and of the weights
  double levels = 0, levelSquares = 0, levelRates = 0;  ///< sums of φ, φ² and φ times the rate
  /// Time after which a level set from further off comes within kFlowNearest, at its pace.
  double clear = std::numeric_limits<double>::infinity();
  /// Deviation of the rate on the surface, rms. Level sets beside it bend more or less than it
  /// does: what of the rate is linear in φ is taken off.
  [[nodiscard]] double unevenness() const;
  NearSurface& operator+=(const NearSurface& other);
};
[[nodiscard]] NearSurface measureNearSurface(const CurvatureState& state, const Field& rate);

/// Volume in voxels³, and its loss when the values rise by one voxel times their weight. Cut by the
/// tangent plane of each grid point's own cube, and by what the surface bends away from it.
struct VolumeAndArea {
  double volume = 0, area = 0;
  VolumeAndArea& operator+=(const VolumeAndArea& other);
};
/// @param rate  what evaluate() made of the state with this `shift`
[[nodiscard]] VolumeAndArea volumeAndAreaOf(const CurvatureState& state, const Field& rate,
                                            double shift);
/// Grid points inside that the blocks of a tree do not hold as active: they change in no step.
[[nodiscard]] double inactiveVolume(const openvdb::FloatTree& tree);

}  // namespace levelset::flow
