#include <algorithm>

#include "levelset/segmented/meshing/sheet_places_vdb.h"

namespace levelset {

using Imath::V3d;
using openvdb::Coord;

namespace {

/// Lowest corner and slot of the face of a tetrahedron opposite to a corner.
std::pair<kuhn::Corner, std::uint32_t> faceOf(std::size_t tetrahedron, std::size_t opposite) {
  std::array<kuhn::Corner, 3> chain{};
  std::size_t n = 0;
  for (std::size_t i = 0; i < 4; ++i)
    if (i != opposite) chain[n++] = kuhn::kTetrahedra[tetrahedron][i];
  return {chain[0], kuhn::faceSlot(chain[1] ^ chain[0], chain[2] ^ chain[0])};
}

}  // namespace

V3d SheetPlaces::place(std::uint16_t key) const {
  const Coord cell = SegmentedData::localOf(key / SheetData::kSlots);
  const std::uint32_t slot = key % SheetData::kSlots;
  return slot < kuhn::tetrahedronSlot(0) ? placeOf(cell, slot)
                                         : placeInside(cell, slot - kuhn::tetrahedronSlot(0));
}

std::optional<V3d> SheetPlaces::storedPoint(const Coord& at, std::uint32_t slot) const {
  const std::int32_t block = reader_.blockOf(at);
  if (block < 0) return std::nullopt;
  const Imath::V3f* point = data_.sheets->pointOf(
      static_cast<std::size_t>(block), SheetData::key(SegmentedData::offsetOf(at), slot));
  return point ? std::optional(V3d(at[0], at[1], at[2]) + V3d(*point)) : std::nullopt;
}

/// Position of a vertex on an edge or a face of a cell.
V3d SheetPlaces::placeOf(const Coord& cell, std::uint32_t slot) const {
  const Coord at = origin_ + cell;
  if (const auto point = storedPoint(at, slot)) return *point;
  if (slot < 7) {
    const std::int32_t block = reader_.blockOf(at);
    const Coord step = cornerOffset(slot + 1);
    const auto t = static_cast<double>(data_.sheets->positionOf(
        static_cast<std::size_t>(block), SheetData::key(SegmentedData::offsetOf(at), slot)));
    return V3d(at[0], at[1], at[2]) +
           V3d(step[0], step[1], step[2]) * std::clamp(t, kuhn::kEndGap, 1 - kuhn::kEndGap);
  }
  const kuhn::FaceSteps& face = kuhn::kFaces[slot - 7];
  V3d sum(0);
  double count = 0;
  for (const auto& [low, high] : {std::pair(0u, face.middle), std::pair(0u, face.upper),
                                  std::pair(face.middle, face.upper)}) {
    if (!crossings_.isCrossed(cell, low, high)) continue;
    sum += placeOf(cell + cornerOffset(low), kuhn::edgeSlot(low ^ high));
    ++count;
  }
  return sum / count;
}

/// Position of a vertex inside a tetrahedron: the end of a junction, or the mean of the vertices
/// on its faces.
V3d SheetPlaces::placeInside(const Coord& cell, std::size_t tetrahedron) const {
  if (const auto point = storedPoint(origin_ + cell, kuhn::tetrahedronSlot(tetrahedron)))
    return *point;
  const CutTetrahedron& cut = crossings_.cut(cell, tetrahedron);
  V3d sum(0);
  double count = 0;
  for (std::size_t opposite = 0; opposite < 4; ++opposite) {
    if (!cut.hasFaceNode[opposite]) continue;
    const auto [low, slot] = faceOf(tetrahedron, opposite);
    sum += placeOf(cell + cornerOffset(low), slot);
    ++count;
  }
  return sum / count;
}

}  // namespace levelset
