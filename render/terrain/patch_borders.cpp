#include "render/terrain/patch_borders.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace render {
namespace {

constexpr double kNoBorderBound = std::numeric_limits<double>::infinity();

struct PatchVertex {
  int column, row;
};

/// Replaces a vertex that is left out by a neighbour on the border. In the south and west that is
/// the next one, in the north and east the one before, so that the diagonals of the cells become
/// those of the wider triangle.
PatchVertex keptVertex(PatchVertex v, int cells, unsigned coarserSides) {
  if (v.column % 2 == 1) {
    if (v.row == 0 && (coarserSides & SouthSide)) ++v.column;
    if (v.row == cells && (coarserSides & NorthSide)) --v.column;
  }
  if (v.row % 2 == 1) {
    if (v.column == 0 && (coarserSides & WestSide)) ++v.row;
    if (v.column == cells && (coarserSides & EastSide)) --v.row;
  }
  return v;
}

/// One side of a patch: its samples are those at `start` + n `along`, and those beside them inside
/// the patch are one `inward` further.
struct PatchBorder {
  PatchVertex start, along, inward;
  bool isUpper;  // in the north or east, where the vertex before the left out one replaces it
};

PatchBorder borderAt(PatchSide side, int cells) {
  switch (side) {
    case SouthSide:
      return {{0, 0}, {1, 0}, {0, 1}, false};
    case NorthSide:
      return {{0, cells}, {1, 0}, {0, -1}, true};
    case WestSide:
      return {{0, 0}, {0, 1}, {1, 0}, false};
    case EastSide:
      break;
  }
  return {{cells, 0}, {0, 1}, {-1, 0}, true};
}

/// Samples of two cells beside a border that become one edge: on the border and inside.
struct BorderPair {
  std::array<double, 3> outer, inner;
  std::array<int, 3> places;  // numbers of the samples along the border
};

/// Largest difference of the two triangulations of a pair. Both are linear between the left out
/// vertex, the other samples, and the point where the old and the new diagonal of a cell cross.
/// That is the centre of the cell.
double pairError(const BorderPair& pair, bool isUpper) {
  const auto& [outer, inner, places] = pair;
  // Where the field ends within the pair, only the upper sides get another diagonal.
  if (places[0] == places[1] || (places[1] == places[2] && !isUpper)) return 0;
  for (int n = 0; n < 3; ++n)
    if (std::isnan(outer[static_cast<std::size_t>(n)] + inner[static_cast<std::size_t>(n)]))
      return kNoBorderBound;
  const double share =
      static_cast<double>(places[1] - places[0]) / static_cast<double>(places[2] - places[0]);
  const double atVertex = outer[1] - (outer[0] + (outer[2] - outer[0]) * share);
  const std::size_t end = isUpper ? 0 : 2;
  const double atCentre = 0.5 * ((outer[end] + inner[1]) - (outer[1] + inner[end]));
  return std::max(std::abs(atVertex), std::abs(atCentre));
}

}  // namespace

PatchBorderSets::PatchBorderSets(int cells) {
  for (unsigned coarser = 0; coarser < ranges_.size(); ++coarser) {
    ranges_[coarser].first = indices_.size();
    add(cells, coarser);
    ranges_[coarser].count = indices_.size() - ranges_[coarser].first;
  }
}

void PatchBorderSets::add(int cells, unsigned coarserSides) {
  const auto addTriangle = [&](PatchVertex a, PatchVertex b, PatchVertex c) {
    std::array<std::uint16_t, 3> numbers{};
    std::size_t n = 0;
    for (const PatchVertex& v : {a, b, c}) {
      const PatchVertex kept = keptVertex(v, cells, coarserSides);
      numbers[n++] = static_cast<std::uint16_t>(kept.row * (cells + 1) + kept.column);
    }
    if (numbers[0] == numbers[1] || numbers[1] == numbers[2] || numbers[2] == numbers[0]) return;
    indices_.insert(indices_.end(), numbers.begin(), numbers.end());
  };
  for (int row = 0; row < cells; ++row)
    for (int column = 0; column < cells; ++column) {
      const PatchVertex low{column, row}, high{column + 1, row + 1};
      addTriangle(low, {column + 1, row}, high);
      addTriangle(low, high, {column, row + 1});
    }
}

std::array<float, 4> patchBorderErrors(const PatchGrid& grid, const TerrainPatch& patch,
                                       std::span<const float> heights) {
  const int cells = grid.layout().pyramid.cells;
  std::array<float, 4> errors{};
  for (std::size_t side = 0; side < kPatchSides.size(); ++side) {
    const PatchBorder border = borderAt(kPatchSides[side], cells);
    const PatchVertex start = border.start, along = border.along, inward = border.inward;
    const auto heightAt = [&](int n, int depth) {
      const int column = start.column + n * along.column + depth * inward.column,
                row = start.row + n * along.row + depth * inward.row;
      return static_cast<double>(heights[static_cast<std::size_t>(row * (cells + 1) + column)]);
    };
    double error = 0;
    for (int first = 0; first < cells; first += 2) {
      BorderPair pair{};
      for (int n = 0; n < 3; ++n) {
        const auto k = static_cast<std::size_t>(n);
        pair.outer[k] = heightAt(first + n, 0);
        pair.inner[k] = heightAt(first + n, 1);
        pair.places[k] = along.column != 0 ? grid.sampleColumn(patch, first + n)
                                           : grid.sampleRow(patch, first + n);
      }
      error = std::max(error, pairError(pair, border.isUpper));
    }
    errors[side] = levelset::heightRoundedUp(error);
  }
  return errors;
}

}  // namespace render
