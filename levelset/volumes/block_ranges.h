#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <vector>

#include "levelset/progress.h"
#include "levelset/volumes/volume.h"

namespace levelset {

/// Min-max hierarchy of a volume: the ranges of the values in blocks of 8³ cells, and in groups of
/// 8³ blocks. It is made once, and finds the blocks that an isosurface crosses for any isovalue.
///
/// Beyond the border, the values continue by GridExtension::Quadratic.
class BlockRanges {
 public:
  static constexpr int kBlock = 8;  ///< cells of a block along an axis
  /// Grid points by which the wide range of a block extends beyond its cells, on each side.
  static constexpr int kReach = 2;
  struct Range {
    float low, high;
  };

  /// @throws Cancelled
  explicit BlockRanges(const Volume& volume, const Progress& progress = {});

  /// Number of blocks along each axis. It is 0 along an axis with a single grid point, which has no
  /// cells.
  [[nodiscard]] Imath::V3i size() const { return size_; }
  /// Memory of the ranges, bytes.
  [[nodiscard]] std::size_t bytes() const;

  /// Ranges of the values in all blocks, ordered by x, y, z. The trilinear interpolant in the cells
  /// of a block has no other values.
  [[nodiscard]] std::vector<Range> blockValues() const { return valuesOf(narrow_); }
  /// Ranges of the values in groups of 8³ blocks, ordered by x, y, z.
  [[nodiscard]] std::vector<Range> groupValues() const { return valuesOf(narrowGroups_); }
  /// Number of groups along each axis.
  [[nodiscard]] Imath::V3i groups() const { return groups_; }

  /// Finds the blocks that have a grid point with a value above the isovalue, and one with a value
  /// of at most the isovalue. The surface of the trilinear interpolant lies in these blocks.
  /// @param isOpenAbove  true: in place of that, a value below the isovalue, and one of at least it
  /// @return lowest grid points of the blocks, ordered by x, y, z
  [[nodiscard]] std::vector<Imath::V3i> crossed(double isovalue, bool isOpenAbove = false) const;
  /// Finds the blocks whose wide range, widened on both sides by a multiple of its width, contains
  /// the isovalue. @param widening  that multiple, at least 0
  /// @return as crossed()
  [[nodiscard]] std::vector<Imath::V3i> crossedWidely(double isovalue, double widening) const;

 private:
  /// Ranges of stored numbers, rescaled to values and rounded outwards.
  [[nodiscard]] std::vector<Range> valuesOf(const std::vector<Range>& stored) const;
  template <typename Takes>
  [[nodiscard]] std::vector<Imath::V3i> blocksWith(const std::vector<Range>& ofBlocks,
                                                   const std::vector<Range>& ofGroups,
                                                   const Takes& takes) const;

  Imath::V3i size_, groups_;
  VolumeScale scale_;
  // Ranges of stored numbers, before rescaling; ordered by x, y, z. Narrow ranges cover the 9³ grid
  // points of a block's cells. Wide ranges cover 13³ points, from two points before them on.
  std::vector<Range> narrow_, wide_, narrowGroups_, wideGroups_;
};

}  // namespace levelset
