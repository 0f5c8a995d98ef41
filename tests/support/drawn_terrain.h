#pragma once

// Properties of the drawn triangles of a terrain, by brute force.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "levelset/mesh.h"
#include "levelset/terrain/height_field.h"
#include "render/camera.h"
#include "render/terrain/terrain_detail.h"
#include "render/terrain/terrain_patch.h"

namespace support {

/// A camera near a ground, at a random place with a random direction.
inline render::Camera randomCamera(const Imath::Box3d& bounds, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const Imath::V3d size = bounds.size();
  const auto point = [&](double lift) {
    return bounds.min + Imath::V3d(unit(random) * size.x, unit(random) * size.y,
                                   size.z * (0.5 + lift * unit(random)));
  };
  render::Camera camera;
  camera.from = point(4);
  camera.to = point(0.5);
  camera.up = {0, 0, 1};
  camera.verticalFov = 0.4 + 0.8 * unit(random);
  camera.width = 320;
  camera.height = 200;
  if (unit(random) < 0.1)
    camera.orthoHeight = size.x * (0.1 + unit(random));
  else if (unit(random) < 0.1)
    camera.axisShift = 80 * unit(random);
  return camera;
}

/// Sample of a position, as a pair (column, row).
using SamplePlace = std::pair<int, int>;
inline SamplePlace sampleAt(const levelset::HeightField& field, const Imath::V3d& p) {
  return {static_cast<int>(std::lround((p.x - field.origin.x) / field.spacing.x)),
          static_cast<int>(std::lround((p.y - field.origin.y) / field.spacing.y))};
}

/// Counts edges that break the surface: edges used twice in one direction, and edges with one
/// triangle whose other side is ground inside a drawn patch.
class CrackCount {
 public:
  CrackCount(const levelset::HeightField& field, const levelset::GroundLayout& layout,
             const render::TerrainSelection& selection)
      : field_(field), grid_(layout), selection_(selection) {}

  [[nodiscard]] std::size_t operator()(const levelset::TriMesh& mesh) {
    std::vector<std::array<std::uint32_t, 3>> edges;  // lower, upper, direction
    for (const auto& triangle : mesh.triangles)
      for (std::size_t n = 0; n < 3; ++n) {
        const std::uint32_t a = triangle[n], b = triangle[(n + 1) % 3];
        edges.push_back({std::min(a, b), std::max(a, b), a < b ? 0u : 1u});
      }
    std::sort(edges.begin(), edges.end());
    std::size_t cracks = 0;
    for (std::size_t n = 0; n < edges.size();) {
      std::size_t end = n + 1;
      while (end < edges.size() && edges[end][0] == edges[n][0] && edges[end][1] == edges[n][1])
        ++end;
      const bool isPair = end - n == 2 && edges[n][2] != edges[n + 1][2];
      const auto [a, b, isBack] = edges[n];
      if (!isPair && !(end - n == 1 &&
                       isBorder(mesh.positions[isBack ? b : a], mesh.positions[isBack ? a : b])))
        ++cracks;
      n = end;
    }
    return cracks;
  }

 private:
  /// Returns true if there is nothing to draw to the right of an edge.
  [[nodiscard]] bool isBorder(const Imath::V3d& a, const Imath::V3d& b) const {
    const auto [ca, ra] = sampleAt(field_, a);
    const auto [cb, rb] = sampleAt(field_, b);
    // A point beside the middle of the edge. The edge is at most as long as the field.
    const double length = std::hypot(cb - ca, rb - ra), reach = 0.01;
    const double x = 0.5 * (ca + cb) + reach * (rb - ra) / length,
                 y = 0.5 * (ra + rb) - reach * (cb - ca) / length;
    for (const auto& part : selection_.parts) {
      const render::TerrainPatch patch{part.level, part.column, part.row};
      const int cells = grid_.layout().pyramid.cells;
      if (x > grid_.sampleColumn(patch, 0) && x < grid_.sampleColumn(patch, cells) &&
          y > grid_.sampleRow(patch, 0) && y < grid_.sampleRow(patch, cells))
        return isMissing(x, y);
    }
    return true;
  }
  [[nodiscard]] bool isMissing(double x, double y) const {
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const bool isLower = x - column > y - row;
    return field_.isMissing(column, row) || field_.isMissing(column + 1, row + 1) ||
           (isLower ? field_.isMissing(column + 1, row) : field_.isMissing(column, row + 1));
  }

  const levelset::HeightField& field_;
  render::PatchGrid grid_;
  const render::TerrainSelection& selection_;
};

/// Heights of the drawn triangles at all samples; NaN where nothing is drawn.
inline std::vector<double> drawnHeights(const levelset::HeightField& field,
                                        const levelset::TriMesh& mesh) {
  std::vector<double> heights(field.heights.size(), std::numeric_limits<double>::quiet_NaN());
  for (const auto& triangle : mesh.triangles) {
    std::array<Imath::V3d, 3> p;
    for (std::size_t n = 0; n < 3; ++n) {
      const Imath::V3d& corner = mesh.positions[triangle[n]];
      const auto [column, row] = sampleAt(field, corner);
      p[n] = {static_cast<double>(column), static_cast<double>(row), corner.z};
    }
    const auto area = [](const Imath::V3d& a, const Imath::V3d& b, double x, double y) {
      return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
    };
    const double whole = area(p[0], p[1], p[2].x, p[2].y);
    const auto [lowX, highX] = std::minmax({p[0].x, p[1].x, p[2].x});
    const auto [lowY, highY] = std::minmax({p[0].y, p[1].y, p[2].y});
    for (int row = static_cast<int>(lowY); row <= static_cast<int>(highY); ++row)
      for (int column = static_cast<int>(lowX); column <= static_cast<int>(highX); ++column) {
        const double a = area(p[1], p[2], column, row), b = area(p[2], p[0], column, row),
                     c = area(p[0], p[1], column, row);
        if (a >= 0 && b >= 0 && c >= 0)
          heights[field.index(column, row)] = (a * p[0].z + b * p[1].z + c * p[2].z) / whole;
      }
  }
  return heights;
}

/// Position of a point in the picture, pixels. Points behind the camera are not in the picture.
struct PicturePoint {
  double x = 0, y = 0;
  bool isInside = false;
};
inline PicturePoint inPicture(const render::Camera& camera, const Imath::M44d& toNdc,
                              const Imath::V3d& p) {
  const double w = p.x * toNdc[0][3] + p.y * toNdc[1][3] + p.z * toNdc[2][3] + toNdc[3][3];
  const double depth = (p - camera.from).dot(camera.axis());
  Imath::V3d ndc;
  toNdc.multVecMatrix(p, ndc);
  const bool isInside = w > 0 && depth > camera.near && depth < camera.farthest() && ndc.x >= 0 &&
                        ndc.x <= 1 && ndc.y >= 0 && ndc.y <= 1;
  return {ndc.x * camera.width, ndc.y * camera.height, isInside};
}

/// Largest distance in the picture between the samples in it and the drawn points above or below,
/// pixels; infinite if nothing is drawn at a sample with four complete cells around it.
inline double largestPixelError(const levelset::HeightField& field, const levelset::TriMesh& mesh,
                                const render::Camera& camera) {
  const std::vector<double> drawn = drawnHeights(field, mesh);
  const Imath::M44d toNdc = camera.worldToNdc();
  double largest = 0;
  for (int row = 0; row < field.rows; ++row)
    for (int column = 0; column < field.columns; ++column) {
      if (field.isMissing(column, row)) continue;
      const Imath::V3d p = field.point(column, row);
      const PicturePoint at = inPicture(camera, toNdc, p);
      if (!at.isInside) continue;
      const double height = drawn[field.index(column, row)];
      if (std::isnan(height)) {
        bool isSurrounded = true;
        for (int r = std::max(row - 1, 0); r <= std::min(row + 1, field.rows - 1); ++r)
          for (int c = std::max(column - 1, 0); c <= std::min(column + 1, field.columns - 1); ++c)
            isSurrounded = isSurrounded && !field.isMissing(c, r);
        if (isSurrounded) return std::numeric_limits<double>::infinity();
        continue;
      }
      const PicturePoint other = inPicture(camera, toNdc, {p.x, p.y, height});
      largest = std::max(largest, std::hypot(at.x - other.x, at.y - other.y));
    }
  return largest;
}

}  // namespace support
