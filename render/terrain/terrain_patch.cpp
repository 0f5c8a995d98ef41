#include "render/terrain/terrain_patch.h"

#include <algorithm>
#include <cmath>

namespace render {
namespace {

int clampedSample(int patch, int n, int cells, int level, int samples) {
  return static_cast<int>(
      std::min<std::int64_t>((std::int64_t{patch} * cells + n) << level, samples - 1));
}

}  // namespace

const levelset::PyramidPatch& PatchGrid::errors(const TerrainPatch& patch) const {
  return layout_.pyramid.levels[static_cast<std::size_t>(patch.level)].at(patch.column, patch.row);
}

int PatchGrid::sampleColumn(const TerrainPatch& patch, int n) const {
  return clampedSample(patch.column, n, layout_.pyramid.cells, patch.level, layout_.columns);
}

int PatchGrid::sampleRow(const TerrainPatch& patch, int n) const {
  return clampedSample(patch.row, n, layout_.pyramid.cells, patch.level, layout_.rows);
}

Imath::Box3d PatchGrid::box(const TerrainPatch& patch) const {
  const levelset::PyramidPatch& heights = errors(patch);
  if (std::isnan(heights.lowest)) return {};
  const int cells = layout_.pyramid.cells;
  const auto corner = [&](int n, float height) {
    return Imath::V3d(layout_.origin.x + sampleColumn(patch, n) * layout_.spacing.x,
                      layout_.origin.y + sampleRow(patch, n) * layout_.spacing.y,
                      static_cast<double>(height));
  };
  return {corner(0, heights.lowest), corner(cells, heights.highest)};
}

std::optional<TerrainPatch> PatchGrid::existing(const TerrainPatch& patch) const {
  const levelset::PyramidLevel& level =
      layout_.pyramid.levels[static_cast<std::size_t>(patch.level)];
  if (patch.column < 0 || patch.row < 0 || patch.column >= level.columns || patch.row >= level.rows)
    return std::nullopt;
  return patch;
}

std::optional<TerrainPatch> PatchGrid::neighbour(const TerrainPatch& patch, PatchSide side) const {
  TerrainPatch beside = patch;
  if (side == SouthSide) --beside.row;
  if (side == NorthSide) ++beside.row;
  if (side == WestSide) --beside.column;
  if (side == EastSide) ++beside.column;
  return existing(beside);
}

std::optional<TerrainPatch> PatchGrid::child(const TerrainPatch& patch, int n) const {
  return existing({patch.level - 1, 2 * patch.column + n % 2, 2 * patch.row + n / 2});
}

}  // namespace render
