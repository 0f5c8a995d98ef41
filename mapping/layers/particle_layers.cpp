#include "mapping/layers/particle_layers.h"

#include <fmt/core.h>

#include <cmath>
#include <optional>

#include "levelset/error.h"
#include "mapping/surface/geodesic.h"
#include "mapping/surface/surface_field.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;

std::string text(const V3d& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z);
}

/// Position of a particle by a Coons patch: blends opposite sides and subtracts the bilinear corner
/// term. Lies on the surface if that is a plane, and nearly so for a quadric.
V3d coons(const PatchSides& border, const ParticleLayer& layer, std::size_t column,
          std::size_t row) {
  const double u = static_cast<double>(column) / static_cast<double>(layer.columns - 1);
  const double v = static_cast<double>(row) / static_cast<double>(layer.rows - 1);
  const V3d &c0 = border[0].front(), &c1 = border[0].back(), &c2 = border[2].back(),
            &c3 = border[2].front();
  return border[0][column] * (1 - v) + border[2][column] * v + border[3][row] * (1 - u) +
         border[1][row] * u -
         (c0 * ((1 - u) * (1 - v)) + c1 * (u * (1 - v)) + c2 * (u * v) + c3 * ((1 - u) * v));
}

/// True if no distance between neighbours exceeds the limit, which is longestU along rows and
/// longestV along columns. A larger distance means that a blended position was projected onto
/// another part of the surface.
bool isUnbroken(const ParticleLayer& layer, double longestU, double longestV) {
  for (std::size_t j = 0; j < layer.rows; ++j)
    for (std::size_t i = 0; i < layer.columns; ++i) {
      if (i > 0 && (layer.at(i, j) - layer.at(i - 1, j)).length() > longestU) return false;
      if (j > 0 && (layer.at(i, j) - layer.at(i, j - 1)).length() > longestV) return false;
    }
  return true;
}

bool sweepBlended(const SurfaceField& field, const SurfaceField& guide, const PatchSides& border,
                  ParticleLayer& layer) {
  for (std::size_t j = 1; j + 1 < layer.rows; ++j)
    for (std::size_t i = 1; i + 1 < layer.columns; ++i) {
      V3d p = coons(border, layer, i, j);
      if (!guide.project(p, layer.height) || !field.project(p, layer.height)) return false;
      layer.positions[j * layer.columns + i] = p;
    }
  const double u = std::max(pathLength(border[0]), pathLength(border[2]));
  const double v = std::max(pathLength(border[1]), pathLength(border[3]));
  return isUnbroken(layer, 4 * u / static_cast<double>(layer.columns - 1),
                    4 * v / static_cast<double>(layer.rows - 1));
}

/// Fills the rows of the layer by geodesics between opposite points of its sides, which never leave
/// the surface.
void sweepGeodesics(const SurfaceField& field, const std::vector<V3d>& firstRow,
                    ParticleLayer& layer) {
  std::vector<V3d> path = firstRow;
  for (std::size_t j = 1; j + 1 < layer.rows; ++j) {
    const V3d a = layer.at(0, j), b = layer.at(layer.columns - 1, j);
    // Adjacent rows take similar paths, even where two paths are equally long.
    path = geodesicLike(field, layer.height, a, b, path);
    if (path.empty()) path = geodesic(field, layer.height, a, b);
    if (path.empty()) {
      throw InvalidInput(
          fmt::format("the surface does not connect {} and {}; move the corners "
                      "closer together",
                      text(a), text(b)));
    }
    const std::vector<V3d> row = sampleByArcLength(path, layer.columns);
    for (std::size_t i = 1; i + 1 < layer.columns; ++i) {
      V3d p = row[i];
      (void)field.project(p, layer.height);
      layer.positions[j * layer.columns + i] = p;
    }
  }
}

/// Joins shortest paths between successive knots: the corners of a side and the given points
/// between them.
/// @param longest  largest length of a path between two knots
/// @return empty if two knots are not connected, or only by a longer path; `gap` is then the index
///         of the first of the two knots
std::vector<V3d> sideThrough(const SurfaceField& field, double height,
                             const std::vector<V3d>& knots, const std::vector<V3d>* below,
                             double longest, std::size_t& gap) {
  if (below && knots.size() == 2) {
    std::vector<V3d> path = geodesicLike(field, height, knots[0], knots[1], *below);
    if (!path.empty()) return path;
  }
  std::vector<V3d> side = {knots.front()};
  for (std::size_t i = 1; i < knots.size(); ++i) {
    const std::vector<V3d> path = geodesic(field, height, knots[i - 1], knots[i], longest);
    gap = i - 1;
    if (path.empty()) return {};
    side.insert(side.end(), path.begin() + 1, path.end());
  }
  return side;
}

}  // namespace

PatchSides makeSides(const levelset::NarrowBand& band, double height,
                     const std::array<V3d, 4>& corners, const PatchSides& between,
                     const PatchSides* below, const PatchSides* ground) {
  const SurfaceField field(band);
  // Largest length of a path along a side, as a multiple of the sum of the side's length on the
  // surface and the height. Half a turn along a side adds π times the height.
  constexpr double kMostGrowth = 4;
  constexpr std::array<std::array<std::size_t, 2>, 4> kEnds = {{{0, 1}, {1, 2}, {3, 2}, {0, 3}}};
  PatchSides sides;
  for (std::size_t side = 0; side < 4; ++side) {
    std::vector<V3d> knots = {corners[kEnds[side][0]]};
    knots.insert(knots.end(), between[side].begin(), between[side].end());
    knots.push_back(corners[kEnds[side][1]]);
    std::size_t gap = 0;
    const double longest = ground ? kMostGrowth * (pathLength((*ground)[side]) + height) : HUGE_VAL;
    sides[side] =
        sideThrough(field, height, knots, below ? &(*below)[side] : nullptr, longest, gap);
    if (!sides[side].empty()) continue;
    const std::string ends =
        fmt::format("joins {} and {}, between corners {} and {}, at height {:.6g}",
                    text(knots[gap]), text(knots[gap + 1]), kEnds[side][0], kEnds[side][1], height);
    if (ground) {
      throw InvalidInput(
          fmt::format("no path shorter than {:.6g} {}: the surface separates them at that "
                      "height; use a lower height, or move the corners closer together",
                      longest, ends));
    }
    throw InvalidInput(fmt::format(
        "no path on the surface {}; put all points on the same surface component", ends));
  }
  return sides;
}

double sideLengthU(const PatchSides& sides) {
  return 0.5 * (pathLength(sides[0]) + pathLength(sides[2]));
}

double sideLengthV(const PatchSides& sides) {
  return 0.5 * (pathLength(sides[1]) + pathLength(sides[3]));
}

Relaxation fillLayer(const levelset::NarrowBand& band, const levelset::NarrowBand& guide,
                     const PatchSides& sides, ParticleLayer& layer) {
  const SurfaceField field(band);
  PatchSides border;
  for (std::size_t side = 0; side < 4; ++side) {
    border[side] = sampleByArcLength(sides[side], side % 2 == 0 ? layer.columns : layer.rows);
    for (std::size_t i = 1; i + 1 < border[side].size(); ++i)
      (void)field.project(border[side][i], layer.height);
  }
  layer.positions.assign(layer.columns * layer.rows, V3d(0));
  for (std::size_t i = 0; i < layer.columns; ++i) {
    layer.positions[i] = border[0][i];
    layer.positions[(layer.rows - 1) * layer.columns + i] = border[2][i];
  }
  for (std::size_t j = 0; j < layer.rows; ++j) {
    layer.positions[j * layer.columns] = border[3][j];
    layer.positions[j * layer.columns + layer.columns - 1] = border[1][j];
  }
  if (!sweepBlended(field, SurfaceField(guide), border, layer))
    sweepGeodesics(field, sides[0], layer);
  const Relaxation relaxation = relax(band, layer);
  addRim(band, layer);
  return relaxation;
}

void addRim(const levelset::NarrowBand& band, ParticleLayer& layer) {
  const SurfaceField field(band);
  const auto columns = static_cast<int>(layer.columns), rows = static_cast<int>(layer.rows);
  layer.rim.assign(2 * (layer.columns + layer.rows) + 4, V3d(0));
  const auto onwards = [&](const V3d& last, const V3d& before) {
    const V3d offset = last - before;
    // Cosine of the largest turn of the surface normal up to a rim particle.
    constexpr double kMostTurn = 0.5;
    const std::optional<V3d> end = walkStraight(field, layer.height, last, offset, offset.length());
    const bool isAhead = end && field.normal(last).dot(field.normal(*end)) > kMostTurn;
    return isAhead ? *end : last + offset;
  };
  for (int j = 0; j < rows; ++j) {
    layer.rim[layer.rimIndex(-1, j)] = onwards(layer.beyond(0, j), layer.beyond(1, j));
    layer.rim[layer.rimIndex(columns, j)] =
        onwards(layer.beyond(columns - 1, j), layer.beyond(columns - 2, j));
  }
  for (int i = 0; i < columns; ++i) {
    layer.rim[layer.rimIndex(i, -1)] = onwards(layer.beyond(i, 0), layer.beyond(i, 1));
    layer.rim[layer.rimIndex(i, rows)] =
        onwards(layer.beyond(i, rows - 1), layer.beyond(i, rows - 2));
  }
  for (const int i : {-1, columns})
    for (const int j : {-1, rows}) {
      const int a = i < 0 ? 0 : columns - 1, b = j < 0 ? 0 : rows - 1;
      const V3d straight = layer.beyond(i, b) + layer.beyond(a, j) - layer.beyond(a, b);
      V3d p = straight;
      layer.rim[layer.rimIndex(i, j)] = field.project(p, layer.height) ? p : straight;
    }
}

void advectPoints(const levelset::NarrowBand& band, double from, double to, std::span<V3d> points) {
  const SurfaceField field(band);
  const double steps = std::max(1.0, std::ceil(std::abs(to - from) / (0.5 * field.voxelSize())));
  const double step = (to - from) / steps;
  for (V3d& point : points) {
    V3d p = point;
    for (int i = 0; i < static_cast<int>(steps); ++i)
      p += field.normal(p + field.normal(p) * (0.5 * step)) * step;
    if (!field.project(p, to)) {
      throw InvalidInput(
          fmt::format("above the point {} the distance to the base does not reach {:.6g}, "
                      "because another part of the base is too near at {}; use a lower height or "
                      "move the patch",
                      text(point), to, text(p)));
    }
    point = p;
  }
}

void raisePoints(const levelset::NarrowBand& band, double height, std::span<const V3d> directions,
                 std::span<V3d> points) {
  // Longest straight path of a point, as a multiple of the height difference: a direction that
  // leans by 84 degrees needs this length.
  constexpr double kFarthest = 10;
  constexpr int kHalvings = 40;
  const SurfaceField field(band);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double rise = height - field.value(points[i]), step = 0.5 * field.voxelSize();
    const auto isAbove = [&](double t) {
      return field.value(points[i] + directions[i] * t) >= height;
    };
    double above = 0;
    while (!isAbove(above)) {
      above += step;
      if (above > kFarthest * rise + step) {
        throw InvalidInput(
            fmt::format("from {} along {} the distance to the base does not reach {:.6g}; "
                        "use a direction that leans less, or a lower height",
                        text(points[i]), text(directions[i]), height));
      }
    }
    double below = std::max(0.0, above - step);
    for (int k = 0; k < kHalvings; ++k) {
      const double middle = 0.5 * (below + above);
      (isAbove(middle) ? above : below) = middle;
    }
    // The band holds distances only in the region above the patch that was swept. Values jump at
    // its end.
    if (field.value(points[i] + directions[i] * above) - height > 0.1 * field.voxelSize()) {
      throw InvalidInput(
          fmt::format("the ray from {} along {} leaves the region above the patch before "
                      "the distance to "
                      "the base reaches {:.6g}; use a direction that leans less, or a lower height",
                      text(points[i]), text(directions[i]), height));
    }
    points[i] += directions[i] * (0.5 * (below + above));
  }
}

}  // namespace mapping
