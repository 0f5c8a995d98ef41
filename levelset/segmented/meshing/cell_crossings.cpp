#include "levelset/segmented/meshing/cell_crossings_vdb.h"

namespace levelset {

using openvdb::Coord;

CellCrossings::CellCrossings(const SegmentedData& data, const Coord& origin)
    : sheets_(*data.sheets) {
  SegmentedReader reader(data);
  for (kuhn::Corner c = 0; c < 8; ++c) {
    const Coord offset = cornerOffset(c);
    const std::int32_t block =
        reader.blockOf(origin.offsetBy(8 * offset[0], 8 * offset[1], 8 * offset[2]));
    if (c == 0) block_ = block;
    if (block < 0) continue;
    for (const std::uint16_t key : sheets_.edgesOf(static_cast<std::size_t>(block))) {
      const Coord at = SegmentedData::localOf(key / SheetData::kSlots);
      Coord place;
      bool isBeyond = false;
      for (int axis = 0; axis < 3; ++axis) {
        place[axis] = at[axis] + 8 * offset[axis];
        isBeyond = isBeyond || place[axis] > 8;
      }
      if (isBeyond) continue;
      masks_[indexOf(place)] |= static_cast<std::uint8_t>(1u << (key % SheetData::kSlots));
      isEmpty_ = false;
    }
  }
}

bool CellCrossings::hasCrossings(const Coord& cell) const {
  for (kuhn::Corner c = 0; c < 8; ++c)
    if (masks_[indexOf(cell + cornerOffset(c))]) return true;
  return false;
}

const CutTetrahedron& CellCrossings::cut(const Coord& cell, std::size_t tetrahedron) const {
  const auto& corners = kuhn::kTetrahedra[tetrahedron];
  std::uint32_t crossed = 0;
  for (std::size_t e = 0; e < CutTetrahedron::kEdges.size(); ++e) {
    const auto [i, j] = CutTetrahedron::kEdges[e];
    crossed |= std::uint32_t{isCrossed(cell, corners[i], corners[j])} << e;
  }
  const bool hasCorner =
      crossed != 0 && block_ >= 0 &&
      sheets_.pointOf(static_cast<std::size_t>(block_),
                      SheetData::key(SegmentedData::offsetOf(cell),
                                     kuhn::tetrahedronSlot(tetrahedron))) != nullptr;
  return cutTetrahedron(crossed, hasCorner);
}

}  // namespace levelset
