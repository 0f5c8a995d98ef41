#include "levelset/terrain/patch_indices.h"

#include <fmt/core.h>

#include <bit>

#include "levelset/error.h"

namespace levelset {
namespace {

/// Makes the triangles of one index set.
class PatchTriangulation {
 public:
  PatchTriangulation(int cells, int level, const FinerNeighbours& finer)
      : cells_(cells), stride_(1 << level), finer_(finer) {}

  std::vector<PatchTriangle> made() {
    for (int row = 0; row < cells_; row += stride_)
      for (int column = 0; column < cells_; column += stride_) {
        const int right = column + stride_, top = row + stride_;
        const bool isEast = right == cells_, isNorth = top == cells_;
        const Corner low{column, row}, high{right, top};
        addDivided({right, row}, low, high, row == 0 ? finer_.south : 0, isEast ? finer_.east : 0);
        addDivided({column, top}, high, low, isNorth ? finer_.north : 0,
                   column == 0 ? finer_.west : 0);
      }
    return std::move(triangles_);
  }

 private:
  struct Corner {
    int column, row;
  };

  [[nodiscard]] std::uint16_t number(const Corner& c) const {
    return static_cast<std::uint16_t>(c.row * (cells_ + 1) + c.column);
  }
  static Corner between(const Corner& from, const Corner& to, int part, int parts) {
    return {from.column + (to.column - from.column) * part / parts,
            from.row + (to.row - from.row) * part / parts};
  }
  void add(const Corner& a, const Corner& b, const Corner& c) {
    triangles_.push_back({number(a), number(b), number(c)});
  }

  /// Adds the triangle of a cell with its right angle at `corner`. Its leg along x, from `alongX`,
  /// is divided for a neighbour that is finer by `levelsX`, and that along y by `levelsY`. The
  /// order alongX, corner, alongY runs counter-clockwise.
  void addDivided(const Corner& corner, const Corner& alongX, const Corner& alongY, int levelsX,
                  int levelsY) {
    const int partsX = 1 << levelsX, partsY = 1 << levelsY;
    // A fan from the end of the other leg, except the triangle beside the right angle.
    for (int n = 0; n + 1 < partsX; ++n)
      add(between(alongX, corner, n, partsX), between(alongX, corner, n + 1, partsX), alongY);
    const Corner apex = between(alongX, corner, partsX - 1, partsX);
    for (int n = 0; n < partsY; ++n)
      add(between(corner, alongY, n, partsY), between(corner, alongY, n + 1, partsY), apex);
  }

  int cells_, stride_;
  FinerNeighbours finer_;
  std::vector<PatchTriangle> triangles_;
};

}  // namespace

int patchLevelCount(int cells) {
  if (cells < 2 || cells > 128 || !std::has_single_bit(static_cast<unsigned>(cells)))
    throw UsageError(
        fmt::format("a patch has {} cells a side; give a power of two from 2 to 128", cells));
  return std::countr_zero(static_cast<unsigned>(cells));
}

std::vector<PatchTriangle> patchTriangles(int cells, int level, const FinerNeighbours& finer) {
  const int levels = patchLevelCount(cells);
  if (level < 0 || level >= levels)
    throw UsageError(fmt::format("the level of a patch is {}; give 0 to {}", level, levels - 1));
  for (const int side : {finer.south, finer.east, finer.north, finer.west})
    if (side < 0 || side > level)
      throw UsageError(
          fmt::format("a neighbour of a patch of level {} is finer by {} levels; give 0 to {}",
                      level, side, level));
  return PatchTriangulation(cells, level, finer).made();
}

std::size_t publishedPatchBytes(int cells) {
  constexpr std::size_t kHeader = 20;
  const auto levels = static_cast<std::size_t>(patchLevelCount(cells));
  const auto side = static_cast<std::size_t>(cells) + 1;
  return kHeader + 2 * side * side + 2 * (levels - 1);
}

}  // namespace levelset
