#include "render/terrain/rays/terrain_tables.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "levelset/error.h"
#include "levelset/progress.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::HeightField;
using levelset::InvalidInput;

constexpr float kNoHeight = std::numeric_limits<float>::max();

/// Lowest and highest height; empty if the first is above the second.
struct HeightRange {
  float low = kNoHeight, high = -kNoHeight;
  void add(const HeightRange& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
  }
};

/// Range of the known samples in the given columns and rows, last ones included.
HeightRange samplesIn(const HeightField& field, int firstColumn, int lastColumn, int firstRow,
                      int lastRow) {
  HeightRange range;
  for (int row = firstRow; row <= lastRow; ++row)
    for (int column = firstColumn; column <= lastColumn; ++column)
      if (const float height = field.at(column, row); !std::isnan(height))
        range.add({height, height});
  return range;
}

/// Fills one level of the pyramid, rows of nodes at a time.
template <typename RangeOf>
void fillLevel(TerrainTables& tables, int level, const RangeOf& rangeOf) {
  const int across = HeightKernel().nodesAlong(tables.cellsU, level),
            up = HeightKernel().nodesAlong(tables.cellsV, level);
  float* const first = tables.ranges.data() + 2 * tables.firstNode[static_cast<std::size_t>(level)];
  tbb::parallel_for(tbb::blocked_range<int>(0, up), [&](const auto& rows) {
    for (int j = rows.begin(); j < rows.end(); ++j)
      for (int i = 0; i < across; ++i) {
        const HeightRange range = rangeOf(i, j);
        const std::size_t node = static_cast<std::size_t>(j) * static_cast<std::size_t>(across) +
                                 static_cast<std::size_t>(i);
        first[2 * node] = range.low;
        first[2 * node + 1] = range.high;
      }
  });
}

void fillPyramid(TerrainTables& tables) {
  const HeightField& field = *tables.field;
  const auto& [firstU, lastU, firstV, lastV] = tables.leftOut;
  if (tables.topLevel > 0)
    fillLevel(tables, 1,
              [&, firstU = firstU, lastU = lastU, firstV = firstV, lastV = lastV](
                  int i, int j) -> HeightRange {
                const int column = 2 * i, row = 2 * j;
                const int endColumn = std::min(column + 2, tables.cellsU),
                          endRow = std::min(row + 2, tables.cellsV);
                const bool isLeftOut = column >= firstU && endColumn - 1 <= lastU &&
                                       row >= firstV && endRow - 1 <= lastV;
                return isLeftOut ? HeightRange() : samplesIn(field, column, endColumn, row, endRow);
              });
  for (int level = 2; level <= tables.topLevel; ++level) {
    const int across = HeightKernel().nodesAlong(tables.cellsU, level - 1),
              up = HeightKernel().nodesAlong(tables.cellsV, level - 1);
    const float* const below =
        tables.ranges.data() + 2 * tables.firstNode[static_cast<std::size_t>(level) - 1];
    fillLevel(tables, level, [&](int i, int j) {
      HeightRange range;
      for (int row = 2 * j; row < std::min(2 * j + 2, up); ++row)
        for (int column = 2 * i; column < std::min(2 * i + 2, across); ++column) {
          const std::size_t node =
              static_cast<std::size_t>(row) * static_cast<std::size_t>(across) +
              static_cast<std::size_t>(column);
          range.add({below[2 * node], below[2 * node + 1]});
        }
      return range;
    });
  }
}

/// Sets the place of the grid in the world.
void setPlace(TerrainTables& tables, const Imath::M44d& transform) {
  const HeightField& field = *tables.field;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 3; ++column)
      if (!std::isfinite(transform[row][column]))
        throw InvalidInput("the transform of a terrain is not finite; give 16 finite numbers");
    if (transform[row][3] != (row == 3 ? 1 : 0))
      throw InvalidInput(
          "the last column of the transform is not 0, 0, 0, 1; give these numbers there, and a "
          "translation in the last row");
  }
  transform.multVecMatrix(V3d(field.origin.x, field.origin.y, 0), tables.origin);
  const double scales[3] = {field.spacing.x, field.spacing.y, 1};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      tables.toWorld[row][column] = scales[row] * transform[row][column];
  double size = 1;
  for (int row = 0; row < 3; ++row) {
    const double* axis = tables.toWorld[row];
    size *= V3d(axis[0], axis[1], axis[2]).length();
  }
  constexpr double kLeastVolume = 1e-12;
  if (!(std::abs(tables.toWorld.determinant()) > kLeastVolume * size))
    throw InvalidInput("the transform of a terrain is singular; give an invertible matrix");
  tables.toGrid = tables.toWorld.inverse();
}

/// Cells of one axis that lie in an interval with all their neighbours: the first and the last one.
std::pair<int, int> cellsInside(double origin, double spacing, int cells, double low, double high) {
  const auto [first, last] = levelset::samplesBetween(origin, spacing, cells + 1, low, high);
  if (first > last) return {0, -1};
  return {first == 0 ? 0 : first + 1, last == cells ? cells - 1 : last - 2};
}

void leaveOut(TerrainTables& tables, const Imath::Box3d& box) {
  const HeightField& field = *tables.field;
  if (!box.hasVolume())
    throw InvalidInput(
        "the box of the ground that is left out is empty; give its lower corner first");
  const auto [firstU, lastU] =
      cellsInside(field.origin.x, field.spacing.x, tables.cellsU, box.min.x, box.max.x);
  const auto [firstV, lastV] =
      cellsInside(field.origin.y, field.spacing.y, tables.cellsV, box.min.y, box.max.y);
  if (lastU < firstU || lastV < firstV)
    throw InvalidInput(
        "the box of the ground that is left out contains no cell with all its neighbours; give one "
        "over the terrain, at least three cells wide");
  tables.leftOut = {firstU, lastU, firstV, lastV};
  const HeightRange range = samplesIn(field, firstU, lastU + 1, firstV, lastV + 1);
  if (range.low > range.high) return;
  if (static_cast<double>(range.low) < box.min.z || static_cast<double>(range.high) > box.max.z)
    throw InvalidInput(fmt::format(
        "the ground that is left out reaches from {:.9g} to {:.9g}, beyond the heights {:.9g} to "
        "{:.9g} of the box; give a box that contains the ground between its walls",
        range.low, range.high, box.min.z, box.max.z));
}

}  // namespace

HeightKernel TerrainTables::kernel() const {
  HeightKernel kernel;
  kernel.heights = field->heights.data();
  kernel.columns = static_cast<std::size_t>(field->columns);
  kernel.ranges = ranges.data();
  std::copy(firstNode.begin(), firstNode.end(), std::begin(kernel.firstNode));
  kernel.cellsU = cellsU;
  kernel.cellsV = cellsV;
  kernel.topLevel = topLevel;
  kernel.firstLeftOutU = leftOut[0];
  kernel.lastLeftOutU = leftOut[1];
  kernel.firstLeftOutV = leftOut[2];
  kernel.lastLeftOutV = leftOut[3];
  return kernel;
}

HeightKernel::HeightRay TerrainTables::gridRay(const Camera::Ray& ray) const {
  const V3d from = (ray.origin - origin) * toGrid, along = ray.direction * toGrid;
  HeightKernel::HeightRay result{};
  result.u = from.x;
  result.v = from.y;
  result.w = from.z;
  result.du = along.x;
  result.dv = along.y;
  result.dw = along.z;
  result.near = ray.near;
  result.far = ray.far;
  // The sides of the corners, the boxes and the distances have errors of a few units in the last
  // place of these lengths.
  constexpr double kPad = 0x1p-44;
  result.pad =
      kPad * (std::abs(from.x) + std::abs(from.y) + std::abs(from.z) + cellsU + cellsV +
              std::abs(static_cast<double>(lowest)) + std::abs(static_cast<double>(highest)));
  HeightKernel().completeRay(result);
  return result;
}

HeightKernel::HeightWalk TerrainTables::start() const {
  return {topLevel, 0, 0, HeightKernel::kNoRoot, 0, 0};
}

TerrainTables makeTerrainTables(std::shared_ptr<const HeightField> field,
                                const Imath::M44d& transform, const Imath::Box3d* box,
                                std::size_t maxBytes) {
  TerrainTables tables{.field = std::move(field)};
  tables.cellsU = tables.field->columns - 1;
  tables.cellsV = tables.field->rows - 1;
  tables.topLevel = static_cast<int>(
      std::bit_width(static_cast<unsigned>(std::max(tables.cellsU, tables.cellsV) - 1)));
  setPlace(tables, transform);
  if (box) leaveOut(tables, *box);
  std::size_t nodes = 0;
  for (int level = 1; level <= tables.topLevel; ++level) {
    tables.firstNode.push_back(nodes);
    nodes += static_cast<std::size_t>(HeightKernel().nodesAlong(tables.cellsU, level)) *
             static_cast<std::size_t>(HeightKernel().nodesAlong(tables.cellsV, level));
  }
  // The walk reads four nodes at a time.
  constexpr std::size_t kBeyond = 8;
  const std::size_t numbers = 2 * nodes + kBeyond;
  levelset::requireMemory(static_cast<double>(numbers * sizeof(float)), maxBytes);
  tables.ranges.resize(numbers);
  fillPyramid(tables);
  tables.box = tables.field->bounds();
  if (!tables.box.isEmpty()) {
    tables.lowest = static_cast<float>(tables.box.min.z);
    tables.highest = static_cast<float>(tables.box.max.z);
  }
  return tables;
}

}  // namespace render
