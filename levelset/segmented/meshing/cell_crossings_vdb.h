#pragma once

// Internal header of levelset. Includes OpenVDB: for .cpp files only.

#include <array>
#include <cstddef>
#include <cstdint>

#include "levelset/segmented/local/cut_tetrahedron.h"
#include "levelset/segmented/local/kuhn_cell.h"
#include "levelset/segmented/segmented_data_vdb.h"

namespace levelset {

/// Offset of a corner from the lowest one of its cell.
inline openvdb::Coord cornerOffset(kuhn::Corner corner) {
  return SegmentedCell::cornerOffset(static_cast<int>(corner));
}

/// Crossed edges of the cells of a block, for fields with sheets. Cells are places in the block.
class CellCrossings {
 public:
  /// @pre the field has sheets
  CellCrossings(const SegmentedData& data, const openvdb::Coord& origin);

  [[nodiscard]] bool isEmpty() const { return isEmpty_; }
  /// @param low, high  corners of a cell; the bits of `high` contain those of `low`
  [[nodiscard]] bool isCrossed(const openvdb::Coord& cell, kuhn::Corner low,
                               kuhn::Corner high) const {
    return masks_[indexOf(cell + cornerOffset(low))] >> kuhn::edgeSlot(low ^ high) & 1;
  }
  /// @return false if no edge of a cell is crossed
  [[nodiscard]] bool hasCrossings(const openvdb::Coord& cell) const;
  /// Number of crossed edges of a face.
  [[nodiscard]] std::uint32_t edgesOfFace(const openvdb::Coord& cell,
                                          const kuhn::FaceSteps& face) const {
    return std::uint32_t{isCrossed(cell, 0, face.middle)} + isCrossed(cell, 0, face.upper) +
           isCrossed(cell, face.middle, face.upper);
  }
  [[nodiscard]] const CutTetrahedron& cut(const openvdb::Coord& cell,
                                          std::size_t tetrahedron) const;

 private:
  static constexpr int kSide = 9;
  [[nodiscard]] static std::size_t indexOf(const openvdb::Coord& at) {
    return static_cast<std::size_t>((at[0] * kSide + at[1]) * kSide + at[2]);
  }

  const SheetData& sheets_;
  std::array<std::uint8_t, kSide * kSide * kSide> masks_{};
  std::int32_t block_ = -1;
  bool isEmpty_ = true;
};

}  // namespace levelset
