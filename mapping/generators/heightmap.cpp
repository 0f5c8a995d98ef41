#include "mapping/generators/heightmap.h"

#include <array>
#include <cmath>

#include "mapping/generators/generator_vdb.h"

namespace mapping {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::ShapeExtent;
using levelset::ShapeOptions;

// Upper bound of the sum of the magnitudes of the weights of cubic convolution, in one dimension.
constexpr double kCubicWeights = 1.25;
// Upper bound of the slope of cubic convolution in one dimension, per spacing of the nodes,
// relative to the largest difference between the values of neighbouring nodes.
constexpr double kCubicSlope = 1.5;

void requireHeightmap(const Heightmap& heightmap, const V3d& center) {
  requirePositive(heightmap.size.x, "the size along x");
  requirePositive(heightmap.size.y, "the size along y");
  requirePositive(heightmap.height, "the height");
  requireNonNegative(heightmap.base, "the base");
  requireFinite(center, "the centre");
  const HeightGrid& grid = heightmap.grid;
  if (grid.columns < 2 || grid.rows < 2) {
    throw levelset::UsageError(fmt::format(
        "the grid has {} columns and {} rows; give at least two of each", grid.columns, grid.rows));
  }
  const auto count = static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows);
  if (grid.heights.size() != count) {
    throw levelset::UsageError(
        fmt::format("the grid of {} x {} nodes has {} heights; give one for each node",
                    grid.columns, grid.rows, grid.heights.size()));
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (std::isfinite(grid.heights[i])) continue;
    throw levelset::UsageError(
        fmt::format("the height in row {}, column {} is {}; give finite numbers",
                    i / static_cast<std::size_t>(grid.columns) + 1,
                    i % static_cast<std::size_t>(grid.columns) + 1, grid.heights[i]));
  }
}

/// Interpolated grid value, and its derivatives with respect to u and v.
struct HeightJet {
  double value = 0;
  V2d slope{0, 0};
};

/// Interpolates the grid values over the unit square of u and v. Beyond the border, cubic
/// convolution uses values of the parabola through the last three nodes, so that it reproduces
/// parabolas up to the border [Keys81].
class HeightSurface {
 public:
  explicit HeightSurface(const Heightmap& heightmap)
      : heightmap_(heightmap), columns_(heightmap.grid.columns), rows_(heightmap.grid.rows) {}

  [[nodiscard]] HeightJet at(double u, double v) const {
    const Station x(u, columns_), y(v, rows_);
    return heightmap_.interpolation == HeightInterpolation::Linear ? linear(x, y) : cubic(x, y);
  }

  struct Range {
    double low = HUGE_VAL, high = -HUGE_VAL;
  };
  /// Bounds of all interpolated values. Cubic interpolation may exceed the values of the nodes.
  [[nodiscard]] Range range() const {
    const bool isLinear = heightmap_.interpolation == HeightInterpolation::Linear;
    const double beyond = isLinear ? 0 : (kCubicWeights * kCubicWeights - 1) / 2;
    Range all;
    for (int j = 0; j + 1 < rows_; ++j)
      for (int i = 0; i + 1 < columns_; ++i) {
        Range near;
        const int reach = isLinear ? 0 : 1;
        for (int n = j - reach; n <= j + 1 + reach; ++n)
          for (int m = i - reach; m <= i + 1 + reach; ++m) {
            near.low = std::min(near.low, node(m, n));
            near.high = std::max(near.high, node(m, n));
          }
        const double more = beyond * (near.high - near.low);
        all.low = std::min(all.low, near.low - more);
        all.high = std::max(all.high, near.high + more);
      }
    return all;
  }

  /// Upper bounds of |∂/∂u| and |∂/∂v| of the interpolated values.
  [[nodiscard]] V2d steepest() const {
    V2d difference(0, 0);
    const bool isLinear = heightmap_.interpolation == HeightInterpolation::Linear;
    const int reach = isLinear ? 0 : 1;
    for (int j = -reach; j < rows_ + reach; ++j)
      for (int i = -reach; i < columns_ + reach; ++i) {
        if (i + 1 < columns_ + reach)
          difference.x = std::max(difference.x, std::abs(node(i + 1, j) - node(i, j)));
        if (j + 1 < rows_ + reach)
          difference.y = std::max(difference.y, std::abs(node(i, j + 1) - node(i, j)));
      }
    const double factor = isLinear ? 1 : kCubicSlope * kCubicWeights;
    return {difference.x * (columns_ - 1) * factor, difference.y * (rows_ - 1) * factor};
  }

 private:
  /// Position along one axis: the node before it, the fraction `t` of the distance to the next
  /// node, and the number `count` of intervals between nodes.
  struct Station {
    int node;
    double t, count;
    Station(double u, int nodes) : count(nodes - 1) {
      const double place = std::clamp(u, 0.0, 1.0) * count;
      node = std::min(static_cast<int>(place), nodes - 2);
      t = place - node;
    }
  };

  /// Value of node (i, j), where (0, 0) has the smallest x and y; also for one node beyond each
  /// border.
  [[nodiscard]] double node(int i, int j) const {
    if (i < 0 || i >= columns_) {
      return beyond(columns_, i, [&](int inner) { return node(inner, j); });
    }
    if (j < 0 || j >= rows_) {
      return beyond(rows_, j, [&](int inner) { return node(i, inner); });
    }
    const auto index =
        static_cast<std::size_t>(rows_ - 1 - j) * static_cast<std::size_t>(columns_) +
        static_cast<std::size_t>(i);
    return heightmap_.grid.heights[index];
  }

  template <typename Inner>
  static double beyond(int count, int i, const Inner& inner) {
    const int first = i < 0 ? 0 : count - 1, step = i < 0 ? 1 : -1;
    if (count == 2) return 2 * inner(first) - inner(first + step);
    return 3 * (inner(first) - inner(first + step)) + inner(first + 2 * step);
  }

  [[nodiscard]] HeightJet linear(const Station& x, const Station& y) const {
    const double a = node(x.node, y.node), b = node(x.node + 1, y.node),
                 c = node(x.node, y.node + 1), d = node(x.node + 1, y.node + 1);
    return {(a + (b - a) * x.t) * (1 - y.t) + (c + (d - c) * x.t) * y.t,
            {((b - a) * (1 - y.t) + (d - c) * y.t) * x.count,
             ((c - a) * (1 - x.t) + (d - b) * x.t) * y.count}};
  }

  [[nodiscard]] HeightJet cubic(const Station& x, const Station& y) const {
    const auto wx = weights(x.t), wy = weights(y.t), sx = slopes(x.t), sy = slopes(y.t);
    HeightJet jet;
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const auto m = static_cast<std::size_t>(i), n = static_cast<std::size_t>(j);
        const double height = node(x.node + i - 1, y.node + j - 1);
        jet.value += wx[m] * wy[n] * height;
        jet.slope += V2d(sx[m] * wy[n] * x.count, wx[m] * sy[n] * y.count) * height;
      }
    return jet;
  }

  static std::array<double, 4> weights(double t) {
    return {t * (t * (2 - t) - 1) / 2, (t * t * (3 * t - 5) + 2) / 2, t * (t * (4 - 3 * t) + 1) / 2,
            t * t * (t - 1) / 2};
  }
  static std::array<double, 4> slopes(double t) {
    return {(t * (4 - 3 * t) - 1) / 2, t * (9 * t - 10) / 2, (t * (8 - 9 * t) + 1) / 2,
            t * (3 * t - 2) / 2};
  }

  const Heightmap& heightmap_;
  int columns_, rows_;
};

/// Bounds of the interpolated heights above the base, world units. With cubic interpolation they
/// may lie outside [0, `height`].
HeightSurface::Range worldRange(const Heightmap& heightmap) {
  HeightSurface::Range range = HeightSurface(heightmap).range();
  return {range.low * heightmap.height, range.high * heightmap.height};
}

class HeightField {
 public:
  HeightField(const Heightmap& heightmap, const Imath::Box3d& tile, const Imath::Box3d& box,
              double voxelSize)
      : heightmap_(heightmap),
        surface_(heightmap),
        tile_(tile),
        box_(box),
        zero_(tile.min.z + heightmap.base),
        trusted_(4 * voxelSize),
        most_(6 * voxelSize) {
    const V2d slope = surface_.steepest() * heightmap.height;
    const V2d world(slope.x / heightmap.size.x, slope.y / heightmap.size.y);
    steepest_ = std::sqrt(1 + world.length2());
  }

  double operator()(const V3d& p) const {
    const HeightJet jet = surface_.at((p.x - tile_.min.x) / heightmap_.size.x,
                                      (p.y - tile_.min.y) / heightmap_.size.y);
    const double above = p.z - zero_ - jet.value * heightmap_.height;
    // The steepest slope of the entire surface gives a lower bound of the distance. Near the
    // surface the local slope gives a better value. Further away a value from the local slope could
    // exceed the distance to a cliff.
    double value = above / steepest_;
    if (std::abs(value) < trusted_) {
      const V2d slope(jet.slope.x / heightmap_.size.x, jet.slope.y / heightmap_.size.y);
      const double normal = std::sqrt(1 + slope.length2() * heightmap_.height * heightmap_.height);
      value = std::clamp(above / normal, -most_, most_);
    }
    return std::max(value, boxDistance(p, box_));
  }

 private:
  const Heightmap& heightmap_;
  HeightSurface surface_;
  Imath::Box3d tile_, box_;
  double zero_, trusted_, most_, steepest_ = 1;
};

}  // namespace

double heightAt(const Heightmap& heightmap, double u, double v) {
  return HeightSurface(heightmap).at(u, v).value;
}

TileBox heightmapBox(const Heightmap& heightmap, const V3d& center) {
  requireHeightmap(heightmap, center);
  const V3d half(heightmap.size.x / 2, heightmap.size.y / 2,
                 (heightmap.base + heightmap.height) / 2);
  return {{center - half, center + half}, {center - half, center + half}};
}

ShapeExtent heightmapExtent(const Heightmap& heightmap, const V3d& center) {
  Imath::Box3d bounds = heightmapBox(heightmap, center).whole;
  const HeightSurface::Range range = worldRange(heightmap);
  bounds.max.z = bounds.min.z + heightmap.base + std::max(range.high, 0.0);
  // Area of the top, from the differences of neighbouring nodes along both axes.
  const HeightGrid& grid = heightmap.grid;
  const double dx = heightmap.size.x / (grid.columns - 1), dy = heightmap.size.y / (grid.rows - 1);
  double top = 0;
  for (std::size_t j = 0; j + 1 < static_cast<std::size_t>(grid.rows); ++j)
    for (std::size_t i = 0; i + 1 < static_cast<std::size_t>(grid.columns); ++i) {
      const std::size_t n = j * static_cast<std::size_t>(grid.columns) + i;
      const double a = grid.heights[n], b = (grid.heights[n + 1] - a) * heightmap.height / dx,
                   c = (grid.heights[n + static_cast<std::size_t>(grid.columns)] - a) *
                       heightmap.height / dy;
      top += dx * dy * std::sqrt(1 + b * b + c * c);
    }
  const V3d size = bounds.size();
  return {bounds, top + size.x * size.y + 2 * (size.x + size.y) * size.z};
}

void checkHeightmap(const Heightmap& heightmap, const V3d& center, double voxelSize,
                    const ShapeOptions& options) {
  levelset::checkShape(heightmapExtent(heightmap, center), voxelSize, options);
}

levelset::NarrowBand makeHeightmap(const Heightmap& heightmap, const V3d& center, double voxelSize,
                                   const ShapeOptions& options) {
  const ShapeExtent extent = heightmapExtent(heightmap, center);
  return makeFromField(
      extent, voxelSize, options,
      HeightField(heightmap, heightmapBox(heightmap, center).tile, extent.bounds, voxelSize));
}

levelset::TriMesh heightmapSheet(const Heightmap& heightmap, const V3d& center, double spacing,
                                 const ShapeOptions& options) {
  const Imath::Box3d tile = heightmapBox(heightmap, center).tile;
  requirePositive(spacing, "the vertex spacing");
  const double columns = std::ceil(heightmap.size.x / spacing * (1 - 1e-9)),
               rows = std::ceil(heightmap.size.y / spacing * (1 - 1e-9));
  constexpr double kBytesPerVertex = 24 + 16 + 2 * 12, kMostVertices = 4294967295.0;
  const double vertices = (columns + 1) * (rows + 1);
  levelset::requireMemory(kBytesPerVertex * vertices, options.maxMemory);
  if (vertices > kMostVertices) {
    throw levelset::ResourceLimit(fmt::format(
        "{:.3g} vertices exceed the limit of a mesh; use a larger vertex spacing", vertices));
  }
  const HeightSurface surface(heightmap);
  levelset::TriMesh mesh;
  const auto across = static_cast<std::uint32_t>(columns), up = static_cast<std::uint32_t>(rows);
  const std::size_t count = (std::size_t{across} + 1) * (std::size_t{up} + 1);
  mesh.positions.reserve(count);
  mesh.attributes.uvs.reserve(count);
  mesh.triangles.reserve(2 * std::size_t{across} * up);
  for (std::uint32_t j = 0; j <= up; ++j) {
    levelset::report(options.progress, static_cast<double>(j) / (rows + 1));
    for (std::uint32_t i = 0; i <= across; ++i) {
      const double u = i / columns, v = j / rows;
      mesh.positions.emplace_back(
          tile.min.x + u * heightmap.size.x, tile.min.y + v * heightmap.size.y,
          tile.min.z + heightmap.base + surface.at(u, v).value * heightmap.height);
      mesh.attributes.uvs.emplace_back(u, v);
      if (i == across || j == up) continue;
      const std::uint32_t a = j * (across + 1) + i, b = a + across + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
  return mesh;
}

}  // namespace mapping
