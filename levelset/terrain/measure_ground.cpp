#include "levelset/terrain/measure_ground.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "levelset/progress_gate.h"
#include "levelset/terrain/ground_triangles.h"

namespace levelset {
namespace {

/// Sum with the compensation of Kahan and Neumaier.
struct CompensatedSum {
  double sum = 0, lost = 0;

  void add(double x) {
    const double next = sum + x;
    lost += std::abs(sum) >= std::abs(x) ? (sum - next) + x : (x - next) + sum;
    sum = next;
  }
  [[nodiscard]] double value() const { return sum + lost; }
};

/// Figures of one row of cells. The heights are those over a triangle's unit of projected area.
struct GroundRow {
  CompensatedSum area, above, below, heights;
  std::size_t triangles = 0;
};

/// Mean over a triangle of the positive part of a linear function, from its values at the corners.
double meanPositivePart(std::array<double, 3> g) {
  std::sort(g.begin(), g.end());
  const auto [least, middle, most] = g;
  if (most <= 0) return 0;
  if (least >= 0) return (least + middle + most) / 3;
  // Where one corner is positive, the positive part is a pyramid above a smaller triangle.
  if (middle <= 0) return most / 3 * (most / (most - middle)) * (most / (most - least));
  const double negative = least / 3 * (least / (least - middle)) * (least / (least - most));
  return (least + middle + most) / 3 - negative;
}

GroundRow measureRow(const HeightField& field, const GroundPlane& plane, int row) {
  GroundRow result;
  const double dx = field.spacing.x, dy = field.spacing.y;
  const auto planeAt = [&](int column, int r) {
    const Imath::V2d p = field.position(column, r);
    return plane.height + plane.slope.x * p.x + plane.slope.y * p.y;
  };
  const auto addTriangle = [&](double corner, double alongX, double alongY,
                               std::array<double, 3> planes) {
    const double slopeX = (alongX - corner) / dx, slopeY = (alongY - corner) / dy;
    result.area.add(std::sqrt(1 + slopeX * slopeX + slopeY * slopeY));
    const std::array<double, 3> over = {corner - planes[0], alongX - planes[1], alongY - planes[2]};
    result.above.add(meanPositivePart(over));
    result.below.add(meanPositivePart({-over[0], -over[1], -over[2]}));
    result.heights.add((corner + alongX + alongY) / 3);
    ++result.triangles;
  };
  for (int column = 0; column + 1 < field.columns; ++column) {
    const terrain::GroundCell cell(field, column, row);
    if (!cell.hasLower() && !cell.hasUpper()) continue;
    const double lowLow = planeAt(column, row), highLow = planeAt(column + 1, row),
                 lowHigh = planeAt(column, row + 1), highHigh = planeAt(column + 1, row + 1);
    if (cell.hasLower())
      addTriangle(cell.highLow, cell.lowLow, cell.highHigh, {highLow, lowLow, highHigh});
    if (cell.hasUpper())
      addTriangle(cell.lowHigh, cell.highHigh, cell.lowLow, {lowHigh, highHigh, lowLow});
  }
  return result;
}

}  // namespace

GroundMeasures measureGround(const HeightField& field, const GroundPlane& plane,
                             const Progress& progress) {
  requireHeights(field);
  requireLengths(field);
  const int cells = std::max(0, field.rows - 1);
  std::vector<GroundRow> rows(static_cast<std::size_t>(cells));
  ProgressGate gate(progress, rows.size());
  tbb::parallel_for(0, cells, [&](int row) {
    rows[static_cast<std::size_t>(row)] = measureRow(field, plane, row);
    gate.advance(1);
  });
  GroundRow all;
  for (const GroundRow& row : rows) {
    all.area.add(row.area.value());
    all.above.add(row.above.value());
    all.below.add(row.below.value());
    all.heights.add(row.heights.value());
    all.triangles += row.triangles;
  }
  const double triangleArea = field.spacing.x * field.spacing.y / 2;
  GroundMeasures result{.area = triangleArea * all.area.value(),
                        .projectedArea = triangleArea * static_cast<double>(all.triangles),
                        .volumeAbove = triangleArea * all.above.value(),
                        .volumeBelow = triangleArea * all.below.value(),
                        .triangles = all.triangles,
                        .missing = field.missingCount()};
  if (all.triangles > 0)
    result.meanHeight = all.heights.value() / static_cast<double>(all.triangles);
  if (const Imath::Box3d bounds = field.bounds(); !bounds.isEmpty()) {
    result.lowest = bounds.min.z;
    result.highest = bounds.max.z;
  }
  report(progress, 1);
  return result;
}

}  // namespace levelset
