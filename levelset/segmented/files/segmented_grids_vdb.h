#pragma once

// Private to levelset/segmented/files: names of the grids of a segmented field in a .vdb file.
// Include it from .cpp files only.

#include <fmt/core.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "levelset/segmented/files/segmented_file.h"
#include "levelset/segmented/local/kuhn_cell.h"

namespace levelset::segmented_file {

// Metadata of the grid of labels.
inline constexpr const char* kVersion = "segmented_version";       // int32
inline constexpr const char* kHalfWidth = "segmented_half_width";  // double, voxels
/// Labels of the regions with sheets inside, separated by spaces; missing without sheets.
inline constexpr const char* kSheetLabels = "segmented_sheets";
inline constexpr std::int32_t kCurrentVersion = 1;

/// Edges of tetrahedra have the first slots of a grid point.
inline constexpr std::uint32_t kEdgeSlots = 7;

/// @param rank  0 for the nearest interface
inline std::string distanceGrid(std::size_t rank) {
  return rank == 0 ? "distance" : fmt::format("distance_{}", rank + 1);
}
inline std::string neighbourGrid(std::size_t rank) {
  return rank == 0 ? "neighbour" : fmt::format("neighbour_{}", rank + 1);
}
inline std::string edgeGrid(std::uint32_t slot) {
  return fmt::format("edge_{}", slot + 1);
}
inline std::string pointGrid(std::uint32_t slot) {
  return fmt::format("point_{}", slot);
}

}  // namespace levelset::segmented_file
