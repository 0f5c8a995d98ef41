#pragma once

// Internal header of levelset. Includes OpenVDB: for .cpp files only.

#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

#include "levelset/segmented/meshing/cell_crossings_vdb.h"

namespace levelset {

/// Positions of the vertices that the cells of a block of a field with sheets own, index
/// coordinates.
class SheetPlaces {
 public:
  /// @pre the field has sheets
  SheetPlaces(const SegmentedData& data, const openvdb::Coord& origin)
      : data_(data), origin_(origin), reader_(data), crossings_(data, origin) {}

  [[nodiscard]] const CellCrossings& crossings() const { return crossings_; }
  /// @param key  voxel and slot of the vertex, as SheetData::key()
  [[nodiscard]] Imath::V3d place(std::uint16_t key) const;
  /// Stored point of a rim or junction in the simplex of a slot.
  [[nodiscard]] std::optional<Imath::V3d> storedPoint(const openvdb::Coord& at,
                                                      std::uint32_t slot) const;

 private:
  [[nodiscard]] Imath::V3d placeOf(const openvdb::Coord& cell, std::uint32_t slot) const;
  [[nodiscard]] Imath::V3d placeInside(const openvdb::Coord& cell, std::size_t tetrahedron) const;

  const SegmentedData& data_;
  openvdb::Coord origin_;
  mutable SegmentedReader reader_;  ///< caches a block
  CellCrossings crossings_;
};

}  // namespace levelset
