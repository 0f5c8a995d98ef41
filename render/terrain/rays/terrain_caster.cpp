#include "render/terrain/rays/terrain_caster.h"

#include <Imath/ImathBoxAlgo.h>
#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "levelset/error.h"
#include "render/terrain/rays/height_walk.h"
#include "render/terrain/rays/terrain_tables.h"

namespace render {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::HeightField;

std::shared_ptr<const TerrainTables> terrainTablesOf(std::shared_ptr<const HeightField> field,
                                                     const TerrainOptions& options) {
  levelset::requireHeights(*field);
  levelset::requireLengths(*field);
  if (field->columns < 2 || field->rows < 2)
    throw levelset::InvalidInput(
        fmt::format("the terrain has {}x{} samples, but a surface needs at least 2x2; give more",
                    field->columns, field->rows));
  return std::make_shared<const TerrainTables>(
      makeTerrainTables(std::move(field), options.transform,
                        options.outside ? &*options.outside : nullptr, options.maxBytes));
}

/// Derivative along one axis, per cell: the central difference, or that on the known side.
double differenceAt(const HeightField& field, int column, int row, int right, int up) {
  const auto heightAt = [&](int sign) {
    const int i = column + sign * right, j = row + sign * up;
    const bool isInside = i >= 0 && j >= 0 && i < field.columns && j < field.rows;
    return static_cast<double>(isInside ? field.at(i, j) : levelset::kMissingHeight);
  };
  const double before = heightAt(-1), here = heightAt(0), after = heightAt(1);
  if (std::isnan(before)) return std::isnan(after) ? 0 : after - here;
  return std::isnan(after) ? here - before : 0.5 * (after - before);
}

V2d sampleSlope(const HeightField& field, int column, int row) {
  return {differenceAt(field, column, row, 1, 0), differenceAt(field, column, row, 0, 1)};
}

V2d facetSlope(const HeightField& field, int column, int row, bool isUpper) {
  const auto heightAt = [&](int right, int up) {
    return static_cast<double>(field.at(column + right, row + up));
  };
  return isUpper ? V2d(heightAt(1, 1) - heightAt(0, 1), heightAt(0, 1) - heightAt(0, 0))
                 : V2d(heightAt(1, 0) - heightAt(0, 0), heightAt(1, 1) - heightAt(1, 0));
}

/// Slope at a position in a triangle, linear between those at its corners. @param u, v  in the cell
V2d smoothSlope(const HeightField& field, int column, int row, bool isUpper, double u, double v) {
  const V2d lowLow = sampleSlope(field, column, row),
            highHigh = sampleSlope(field, column + 1, row + 1);
  if (isUpper)
    return lowLow * (1 - v) + sampleSlope(field, column, row + 1) * (v - u) + highHigh * u;
  return lowLow * (1 - u) + sampleSlope(field, column + 1, row) * (u - v) + highHigh * v;
}

}  // namespace

TerrainCaster::TerrainCaster(std::shared_ptr<const HeightField> field,
                             const TerrainOptions& options)
    : tables_(terrainTablesOf(std::move(field), options)), options_(options) {
  if (!tables_->box.isEmpty()) bounds_ = Imath::transform(tables_->box, options.transform);
}

const HeightField& TerrainCaster::field() const {
  return *tables_->field;
}

std::vector<double> TerrainCaster::extents(const std::vector<V3d>& directions) const {
  const HeightField& heights = field();
  const std::vector<double> none(directions.size(), -std::numeric_limits<double>::infinity());
  std::vector<V3d> along;  // the directions in the coordinates of the grid
  for (const V3d& direction : directions)
    along.push_back(direction * tables_->toWorld.transposed());
  std::vector<double> most = tbb::parallel_reduce(
      tbb::blocked_range<int>(0, heights.rows), none,
      [&](const auto& rows, std::vector<double> found) {
        for (int row = rows.begin(); row < rows.end(); ++row)
          for (int column = 0; column < heights.columns; ++column) {
            if (heights.isMissing(column, row)) continue;
            const V3d p(column, row, static_cast<double>(heights.at(column, row)));
            for (std::size_t n = 0; n < along.size(); ++n)
              found[n] = std::max(found[n], p.dot(along[n]));
          }
        return found;
      },
      [](std::vector<double> a, const std::vector<double>& b) {
        for (std::size_t n = 0; n < a.size(); ++n) a[n] = std::max(a[n], b[n]);
        return a;
      });
  // The sum turns a negative zero, which depends on the order, into zero.
  for (std::size_t n = 0; n < most.size(); ++n)
    most[n] = most[n] + directions[n].dot(tables_->origin) + 0.0;
  return most;
}

std::size_t TerrainCaster::bytes() const {
  return tables_->bytes();
}

TerrainHit TerrainCaster::firstHit(const Camera::Ray& ray) const {
  const HeightKernel::HeightRay grid = tables_->gridRay(ray);
  const HeightKernel::HeightWalk walk = walkGround(*tables_, grid, false, hasWideHeights());
  return walk.t < HeightKernel::kNoRoot ? hitAt(ray, walk.t, walk.column, walk.halfRow)
                                        : TerrainHit();
}

std::vector<TerrainHit> TerrainCaster::firstHits(std::span<const Camera::Ray> rays) const {
  std::vector<TerrainHit> hits;
  hits.reserve(rays.size());
  for (const Camera::Ray& ray : rays) hits.push_back(firstHit(ray));
  return hits;
}

bool TerrainCaster::isOccluded(const Camera::Ray& ray) const {
  return walkGround(*tables_, tables_->gridRay(ray), true, hasWideHeights()).t <
         HeightKernel::kNoRoot;
}

TerrainHit TerrainCaster::hitAt(const Camera::Ray& ray, double distance, int column,
                                int halfRow) const {
  const HeightField& heights = field();
  const HeightKernel::HeightRay grid = tables_->gridRay(ray);
  const int row = halfRow / 2;
  const bool isUpper = halfRow % 2 != 0;
  TerrainHit hit{.found = true, .distance = distance, .column = column, .halfRow = halfRow};
  hit.height = grid.w + distance * grid.dw;
  // The slopes become the normal of a plane in the grid, whose image is that of the inverse map.
  const Imath::M33d normals = tables_->toGrid.transposed();
  const auto normalOf = [&](const V2d& slope) {
    return (V3d(-slope.x, -slope.y, 1) * normals).normalized();
  };
  hit.facetNormal = normalOf(facetSlope(heights, column, row, isUpper));
  hit.normal = hit.facetNormal;
  if (!options_.isSmooth) return hit;
  const double u = std::clamp(grid.u + distance * grid.du - column, 0.0, 1.0),
               v = std::clamp(grid.v + distance * grid.dv - row, 0.0, 1.0);
  hit.normal = normalOf(smoothSlope(heights, column, row, isUpper, u, v));
  return hit;
}

}  // namespace render
