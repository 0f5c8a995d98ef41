#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "levelset/narrow_band.h"
#include "render/shading/field_shape.h"

namespace render {

/// All of a band's field for rays, not its zero set alone: the values of the blocks of 8³ cells
/// where it is not constant, and a table that finds them. Space is the band's index space less a
/// whole number of blocks, so that all of them begin at 0.
class FieldGrid {
 public:
  static constexpr int kEdge = 8;    ///< cells of a block along an axis
  static constexpr int kPoints = 9;  ///< its points, with those of the last face
  struct Range {
    double low, high;
  };
  /// Values about a cell, from two points before its first corner on.
  using FieldWindow = double[6][6][6];

  /// Bytes that a band's blocks take, at most.
  [[nodiscard]] static double bytesOf(const levelset::NarrowBand& band);
  /// @pre the band is not empty
  /// @throws levelset::ResourceLimit for a band that spans more than the table can hold
  explicit FieldGrid(const levelset::NarrowBand& band);

  /// Takes where the band is anew. @return has it moved? @pre it has the values that this was made
  /// of
  bool updateTransform(const levelset::NarrowBand& band);

  [[nodiscard]] const Imath::M44d& indexToWorld() const { return indexToWorld_; }
  [[nodiscard]] const Imath::M44d& worldToIndex() const { return worldToIndex_; }
  /// Blocks along an axis; beyond them the field is the background.
  [[nodiscard]] int size(int axis) const { return size_[static_cast<std::size_t>(axis)]; }
  [[nodiscard]] double background() const { return background_; }
  [[nodiscard]] std::size_t blockCount() const { return ranges_.size(); }
  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] Imath::Box3d worldBox() const;

  /// Number of a block within the size; negative: the field is constant there.
  [[nodiscard]] int block(int x, int y, int z) const {
    const int entries =
        page_[static_cast<std::size_t>(((x >> 3) * pages_[1] + (y >> 3)) * pages_[2] + (z >> 3))];
    if (entries < 0) return entries;
    return entry_[static_cast<std::size_t>(entries + ((x & 7) << 6 | (y & 7) << 3 | (z & 7)))];
  }
  /// Of the values in such a block.
  [[nodiscard]] Range range(int block) const {
    if (block < 0) return {constant(block), constant(block)};
    return ranges_[static_cast<std::size_t>(block)];
  }
  /// Of a block, by x, y, z of kPoints each.
  [[nodiscard]] const float* values(int block) const {
    return values_.data() + static_cast<std::size_t>(block) * kValues;
  }
  /// Value and derivatives at a place in the world: the interpolant's, and those of the
  /// quasi-interpolating tricubic B-spline.
  [[nodiscard]] FieldShape shapeAt(const Imath::V3d& world) const;

 private:
  static constexpr int kOutside = -1, kInside = -2;
  static constexpr std::size_t kValues = kPoints * kPoints * kPoints;
  [[nodiscard]] double constant(int block) const {
    return block == kInside ? -background_ : background_;
  }
  void read(const std::array<int, 3>& low, FieldWindow& window) const;

  double background_ = 0;  // world units, as values are
  Imath::V3d corner_;      // of the table, in the band's index space
  std::array<int, 3> size_{}, pages_{};
  // As in BrickPool: where a page of 8³ blocks has its entries, or what it is all of; numbers of
  // blocks.
  std::vector<std::int32_t> page_, entry_;
  std::vector<Range> ranges_;
  std::vector<float> values_;
  Imath::M44d indexToWorld_, worldToIndex_;
};

}  // namespace render
