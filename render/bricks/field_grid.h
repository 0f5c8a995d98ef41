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

/// The complete field φ of a band, not only its zero set, for rays. It holds the blocks of 8³ cells
/// in which the values are not constant, and a table that finds them. Positions are in the band's
/// index space minus a multiple of the block size, so that blocks start at 0.
class FieldGrid {
 public:
  static constexpr int kEdge = 8;  ///< cells of a block along an axis
  static constexpr int kPoints =
      9;  ///< grid points of a block along an axis, with those of its last face
  struct Range {
    double low, high;
  };
  /// Values at the 6³ grid points around a cell, starting two points before its lowest corner.
  using FieldWindow = double[6][6][6];
  /// Numbers of blocks in which the field is the background, or minus the background.
  static constexpr int kOutside = -1, kInside = -2;
  /// Values of a block.
  static constexpr std::size_t kValues = std::size_t{kPoints} * kPoints * kPoints;

  /// Upper bound on the memory of a band's blocks, bytes.
  [[nodiscard]] static double bytesOf(const levelset::NarrowBand& band);
  /// @pre the band is not empty
  /// @throws levelset::ResourceLimit for a band that spans more voxels than the table supports
  explicit FieldGrid(const levelset::NarrowBand& band);

  /// Copies the transform of the band. Returns true when it differs from the previous transform.
  /// @pre the band has the values that this grid was built from
  bool updateTransform(const levelset::NarrowBand& band);

  [[nodiscard]] const Imath::M44d& indexToWorld() const { return indexToWorld_; }
  [[nodiscard]] const Imath::M44d& worldToIndex() const { return worldToIndex_; }
  /// Number of blocks of the grid along an axis. Outside these blocks the field equals the
  /// background, the value outside the band.
  [[nodiscard]] int size(int axis) const { return size_[static_cast<std::size_t>(axis)]; }
  [[nodiscard]] double background() const { return background_; }
  [[nodiscard]] std::size_t blockCount() const { return ranges_.size(); }
  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] Imath::Box3d worldBox() const;

  /// Number of the block at (x, y, z), counted in blocks and within size(); negative when the field
  /// is constant in the block.
  [[nodiscard]] int block(int x, int y, int z) const {
    const int entries =
        page_[static_cast<std::size_t>(((x >> 3) * pages_[1] + (y >> 3)) * pages_[2] + (z >> 3))];
    if (entries < 0) return entries;
    return entry_[static_cast<std::size_t>(entries + ((x & 7) << 6 | (y & 7) << 3 | (z & 7)))];
  }
  /// Range of the values in a block, world units. @param block  number from block(), which may be
  /// negative
  [[nodiscard]] Range range(int block) const {
    if (block < 0) return {constant(block), constant(block)};
    return ranges_[static_cast<std::size_t>(block)];
  }
  /// Values of a block ordered by x, y, z, kPoints along each axis, world units. @pre `block` is
  /// not negative
  [[nodiscard]] const float* values(int block) const {
    return values_.data() + static_cast<std::size_t>(block) * kValues;
  }
  /// Tables of the grid, for the upload to the GPU.
  [[nodiscard]] const std::vector<std::int32_t>& pages() const { return page_; }
  [[nodiscard]] const std::vector<std::int32_t>& entries() const { return entry_; }
  [[nodiscard]] const std::vector<Range>& ranges() const { return ranges_; }
  [[nodiscard]] const std::vector<float>& allValues() const { return values_; }
  /// Value and gradient of the trilinear interpolant at a world position, and first and second
  /// derivatives of the quasi-interpolating tricubic B-spline there.
  [[nodiscard]] FieldShape shapeAt(const Imath::V3d& world) const;

 private:
  [[nodiscard]] double constant(int block) const {
    return block == kInside ? -background_ : background_;
  }
  void read(const std::array<int, 3>& low, FieldWindow& window) const;

  double background_ = 0;  // |φ| outside the band, world units
  Imath::V3d corner_;      // lowest corner of the box of all blocks, in the band's index space
  std::array<int, 3> size_{}, pages_{};
  // Two-level table with pages of 8³ blocks. page_: position of the page's items in entry_; entry_:
  // number of the block. kOutside or kInside marks a page or block with a constant field.
  std::vector<std::int32_t> page_, entry_;
  std::vector<Range> ranges_;
  std::vector<float> values_;
  Imath::M44d indexToWorld_, worldToIndex_;
};

}  // namespace render
