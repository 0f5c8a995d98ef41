#include "mapping/generators/hexagons.h"

#include <cmath>
#include <numbers>

#include "mapping/generators/generator_vdb.h"

namespace mapping {
namespace {

using Imath::V2d;
using Imath::V3d;
using levelset::ShapeExtent;
using levelset::ShapeOptions;

constexpr double kRoot3 = std::numbers::sqrt3;

V2d hexagonPeriod(const Hexagons& hexagons) {
  const double spacing = hexagons.size + hexagons.gap;
  return {spacing, spacing * kRoot3 / 2};
}

void requireHexagons(const Hexagons& hexagons, const V3d& center) {
  requirePositive(hexagons.size, "the size");
  requirePositive(hexagons.gap, "the gap");
  requirePositive(hexagons.height, "the height");
  requireNonNegative(hexagons.base, "the base");
  requireNonNegative(hexagons.rounding, "the rounding");
  requireTiling(hexagons.tiling);
  requireFinite(center, "the centre");
  const double widest = hexagons.kind == HexagonKind::Raised ? hexagons.size : hexagons.gap;
  const double most = std::min(widest / 2, hexagons.height);
  if (hexagons.rounding > most) {
    throw levelset::UsageError(
        fmt::format("a rounding of {:.6g} is too large for the edges; give at most {:.6g}",
                    hexagons.rounding, most));
  }
}

/// Signed distance to a hexagon around the origin.
/// @param apothem  distance from the hexagon's centre to its sides
double hexagonDistance(double x, double y, double apothem) {
  x = std::abs(x);
  y = std::abs(y);
  // After mirroring at the line at 30 degrees, the side perpendicular to x is the nearest one.
  if (y * kRoot3 > x) {
    const double mirrored = (x + kRoot3 * y) / 2;
    y = std::abs((kRoot3 * x - y) / 2);
    x = mirrored;
  }
  const double beyond = x - apothem, beside = std::max(0.0, y - apothem / kRoot3);
  return beyond > 0 ? std::sqrt(beyond * beyond + beside * beside) : beyond;
}

/// Signed distance to an infinite pattern of hexagons. The plate, or without a plate the pillars or
/// walls, extends infinitely downwards. `origin` is the centre of a hexagon, at the top of the
/// plate. The distance is exact, except inside the plate where the top of a pillar or wall is the
/// nearest face: there the depth is too large.
class HexagonField {
 public:
  HexagonField(const Hexagons& hexagons, const V3d& origin)
      : hexagons_(hexagons), period_(hexagonPeriod(hexagons)), origin_(origin) {}

  double operator()(const V3d& world) const {
    const V3d p = world - origin_;
    const V2d q = toNearest(p);
    const double r = hexagons_.rounding, top = p.z - hexagons_.height + r;
    const bool isRaised = hexagons_.kind == HexagonKind::Raised;
    const double side = isRaised ? hexagonDistance(q.x, q.y, hexagons_.size / 2 - r)
                                 : r - hexagonDistance(q.x, q.y, hexagons_.size / 2);
    const double wall = convexEdge(side, top) - r;
    return hexagons_.base > 0 ? concaveEdge(wall, p.z) : wall;
  }

 private:
  /// Position relative to the nearest hexagon centre, which is in one of the two nearest rows.
  [[nodiscard]] V2d toNearest(const V3d& p) const {
    V2d best(HUGE_VAL, HUGE_VAL);
    const double low = std::floor(p.y / period_.y);
    for (const double row : {low, low + 1}) {
      const double aside = std::remainder(row, 2.0) != 0 ? 0.5 : 0;
      const double column = std::round(p.x / period_.x - aside);
      const V2d q(p.x - (column + aside) * period_.x, p.y - row * period_.y);
      if (q.length2() < best.length2()) best = q;
    }
    return best;
  }

  const Hexagons& hexagons_;
  V2d period_;
  V3d origin_;
};

}  // namespace

TileBox hexagonsBox(const Hexagons& hexagons, const V3d& center) {
  requireHexagons(hexagons, center);
  return tileBox(hexagons.tiling, hexagonPeriod(hexagons), -hexagons.base, hexagons.height, center);
}

ShapeExtent hexagonsExtent(const Hexagons& hexagons, const V3d& center) {
  const Imath::Box3d bounds = hexagonsBox(hexagons, center).whole;
  const V3d size = bounds.size();
  const V2d period = hexagonPeriod(hexagons);
  // Area of the six upright sides of each hexagon, per area of the plate. Horizontal faces are
  // added below.
  const double walls = 2 * kRoot3 * hexagons.size * hexagons.height / (period.x * period.y);
  return {bounds, size.x * size.y * (2 + walls) + 2 * (size.x + size.y) * size.z};
}

void checkHexagons(const Hexagons& hexagons, const V3d& center, double voxelSize,
                   const ShapeOptions& options) {
  const ShapeExtent extent = hexagonsExtent(hexagons, center);
  levelset::checkShape(extent, voxelSize, options);
  requireResolved(hexagons.size, voxelSize, "the size");
  requireResolved(hexagons.gap, voxelSize, "the gap");
}

levelset::NarrowBand makeHexagons(const Hexagons& hexagons, const V3d& center, double voxelSize,
                                  const ShapeOptions& options) {
  checkHexagons(hexagons, center, voxelSize, options);
  const TileBox box = hexagonsBox(hexagons, center);
  const V2d period = hexagonPeriod(hexagons);
  // The side of the tile at its smallest y passes through the centres of the hexagons in the first
  // row. A side of the tile between two rows would cut slivers off the corners of the next row.
  const V3d origin(box.tile.min.x + period.x / 2, box.tile.min.y, box.tile.max.z - hexagons.height);
  const HexagonField pattern(hexagons, origin);
  const double exact = (options.halfWidth + 0.5) * voxelSize;
  return levelset::makeShape(
      hexagonsExtent(hexagons, center), voxelSize, options,
      [&](const V3d& p) { return clippedDistance(pattern, p, box.whole, exact, voxelSize); });
}

}  // namespace mapping
