#pragma once

// Internal header of levelset: public headers must not include it.

#include <array>
#include <vector>

#include "levelset/distance/surface/lanes.h"
#include "levelset/grids/padded_leaf_vdb.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Value, gradient and second derivatives of an interpolated field. The unit of length of the
/// derivatives is the voxel.
struct Jet {
  double value = 0;
  openvdb::Vec3d gradient;
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;

  [[nodiscard]] openvdb::Vec3d hessianTimes(const openvdb::Vec3d& v) const {
    return {xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
            xz * v.x() + yz * v.y() + zz * v.z()};
  }
};

/// Jet in single precision, for arrays with millions of entries.
struct CompactJet {
  std::array<float, 10> numbers{};
  CompactJet() = default;
  CompactJet(const JetOf<DoubleLanes>& jets, int lane)
      : CompactJet(Jet{jets.value[lane], vectorOf(jets.gradient, lane), jets.xx[lane],
                       jets.yy[lane], jets.zz[lane], jets.xy[lane], jets.xz[lane], jets.yz[lane]}) {
  }
  explicit CompactJet(const Jet& jet) {
    const double all[] = {jet.value, jet.gradient.x(), jet.gradient.y(), jet.gradient.z(), jet.xx,
                          jet.yy,    jet.zz,           jet.xy,           jet.xz,           jet.yz};
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<float>(all[i]);
  }
  [[nodiscard]] Jet jet() const {
    const auto at = [this](std::size_t i) { return static_cast<double>(numbers[i]); };
    return {at(0), {at(1), at(2), at(3)}, at(4), at(5), at(6), at(7), at(8), at(9)};
  }
};

/// Dense copy of a leaf block and of four grid points on each side of it. Interpolates tricubically
/// (Catmull-Rom: passes through the grid values, C¹). Positions are in voxels from the first grid
/// point of the leaf.
class DenseBlock {
 public:
  using Values = PaddedLeaf<4>;
  static constexpr int kPad = Values::kPad;
  static constexpr int kSide = Values::kSide;
  /// Bounds of the positions whose 4³ stencil lies inside the copy.
  static constexpr double kDomainMin = 1 - kPad;
  static constexpr double kDomainMax = kSide - kPad - 2;

  /// Reads the values around the leaf block that begins at `origin`.
  void load(const openvdb::FloatGrid::ConstAccessor& accessor, const openvdb::Coord& origin);

  [[nodiscard]] const openvdb::Coord& origin() const { return origin_; }
  [[nodiscard]] float at(int x, int y, int z) const {
    return values_.values[Values::slot(x, y, z)];
  }
  /// Returns true if the values in a box of grid points have both signs.
  /// @param low, high  the box, inclusive; it has two or three grid points along each axis
  [[nodiscard]] bool changesSign(const std::array<int, 3>& low,
                                 const std::array<int, 3>& high) const;
  [[nodiscard]] static bool contains(const openvdb::Vec3d& p) {
    for (int i = 0; i < 3; ++i)
      if (!(p[i] >= kDomainMin && p[i] < kDomainMax)) return false;
    return true;
  }
  /// Interpolates value and derivatives at a position.
  /// @pre contains(p)
  [[nodiscard]] Jet jet(const openvdb::Vec3d& p) const;
  /// Interpolates value and gradient at a position, and leaves the second derivatives in `jet`.
  /// @pre contains(p)
  void slope(const openvdb::Vec3d& p, Jet& jet) const;

  /// Interpolates value and derivatives at a position for each lane, with the same bits as jet().
  /// @pre contains() each position
  void jets(const Triple<DoubleLanes>& p, JetOf<DoubleLanes>& result) const;

 private:
  friend class DenseBlockCache;
  openvdb::Coord origin_;
  Values values_;
};

/// Cache of a few dense blocks of one tree, for queries at neighbouring positions. One per thread.
class DenseBlockCache {
 public:
  explicit DenseBlockCache(const openvdb::FloatTree& tree) : accessor_(tree) {}
  /// Returns the block of the leaf that contains `position` (index space). Valid until the next
  /// call.
  const DenseBlock& around(const openvdb::Vec3d& position);
  /// Returns the block of the leaf that begins at `origin`. Valid until the next call.
  const DenseBlock& at(const openvdb::Coord& origin);
  /// Interpolates value and gradient at a position for each lane, in index space, and leaves the
  /// second derivatives in `result`. Gives the same bits as DenseBlock::slope().
  void slopes(const Triple<DoubleLanes>& positions, JetOf<DoubleLanes>& result);

 private:
  struct Slot {
    bool used = false;
    DenseBlock block;
  };
  static constexpr std::size_t kSlots = 64;
  openvdb::FloatGrid::ConstAccessor accessor_;
  std::vector<Slot> slots_ = std::vector<Slot>(kSlots);
};

/// Returns the first grid point of the leaf block that contains a position in index space.
[[nodiscard]] inline openvdb::Coord leafOrigin(const openvdb::Vec3d& position) {
  return openvdb::Coord::floor(position) & ~7;
}

}  // namespace levelset::eikonal
