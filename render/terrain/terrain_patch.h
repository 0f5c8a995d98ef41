#pragma once

#include <Imath/ImathBox.h>

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "levelset/terrain/tiles/patch_store.h"

namespace render {

/// Place of a patch in the pyramid of a terrain.
struct TerrainPatch {
  int level = 0, column = 0, row = 0;
  auto operator<=>(const TerrainPatch&) const = default;
};

/// Hash of a patch for tables.
struct PatchHash {
  std::size_t operator()(const TerrainPatch& patch) const {
    const auto bits = [](int n) { return static_cast<std::uint64_t>(static_cast<unsigned>(n)); };
    // Golden ratios spread neighbours over the table.
    std::uint64_t hash = (bits(patch.column) << 32 | bits(patch.row)) * 0x9E3779B97F4A7C15ull;
    hash = (hash ^ hash >> 29) + bits(patch.level);
    return static_cast<std::size_t>(hash * 0xBF58476D1CE4E5B9ull >> 7);
  }
};

/// Sides of a patch as bits of a set.
enum PatchSide : unsigned { SouthSide = 1, EastSide = 2, NorthSide = 4, WestSide = 8 };
inline constexpr std::array<PatchSide, 4> kPatchSides = {SouthSide, EastSide, NorthSide, WestSide};

/// Places of the patches of a terrain, and the boxes of their ground.
/// @pre the layout outlives the object
class PatchGrid {
 public:
  explicit PatchGrid(const levelset::GroundLayout& layout) : layout_(layout) {}

  [[nodiscard]] const levelset::GroundLayout& layout() const { return layout_; }
  [[nodiscard]] int topLevel() const { return static_cast<int>(layout_.pyramid.levels.size()) - 1; }
  [[nodiscard]] TerrainPatch root() const { return {topLevel(), 0, 0}; }
  [[nodiscard]] const levelset::PyramidPatch& errors(const TerrainPatch& patch) const;
  /// Number of sample n of a patch along x (`column` of the patch) or y, in the entire field.
  [[nodiscard]] int sampleColumn(const TerrainPatch& patch, int n) const;
  [[nodiscard]] int sampleRow(const TerrainPatch& patch, int n) const;
  /// Box of the ground and of all its approximations in the patch, world units; empty if all
  /// samples are missing.
  [[nodiscard]] Imath::Box3d box(const TerrainPatch& patch) const;
  /// Patch of the same level at a side; none at the border of the field.
  [[nodiscard]] std::optional<TerrainPatch> neighbour(const TerrainPatch& patch,
                                                      PatchSide side) const;
  /// Patch n of the next finer level, n from 0 to 3; none beyond the border of the field.
  [[nodiscard]] std::optional<TerrainPatch> child(const TerrainPatch& patch, int n) const;
  /// Patch of the next coarser level. @pre the patch is not the root
  [[nodiscard]] static TerrainPatch parent(const TerrainPatch& patch) {
    return {patch.level + 1, patch.column / 2, patch.row / 2};
  }

 private:
  [[nodiscard]] std::optional<TerrainPatch> existing(const TerrainPatch& patch) const;

  const levelset::GroundLayout& layout_;
};

}  // namespace render
