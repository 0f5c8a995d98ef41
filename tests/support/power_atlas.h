#pragma once

// Atlas of 20 regions in a ball, with closed forms of its measures, for tests.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/support/bands.h"
#include "tests/support/meshes.h"

namespace support {

/// Power diagram of 20 weighted sites in the unit ball. Cell k has the label k + 1. Interfaces are
/// parts of planes and of the sphere, junctions parts of lines and of circles.
class PowerAtlas {
 public:
  static constexpr std::size_t kCells = 20;
  struct Plane {
    V3d normal;
    double offset;  ///< the cell lies where normal · x < offset
  };

  /// Plane between two cells, as seen from the first.
  [[nodiscard]] Plane plane(std::size_t i, std::size_t j) const {
    const V3d between = sites_[j] - sites_[i];
    const double length = between.length();
    return {between / length,
            (sites_[j].length2() - weights_[j] - sites_[i].length2() + weights_[i]) / (2 * length)};
  }

  /// Function of a cell: negative inside, exact except beyond its edges.
  [[nodiscard]] double value(std::size_t i, const V3d& p) const {
    double result = p.length() - 1;
    for (std::size_t j = 0; j < kCells; ++j) {
      if (j == i) continue;
      const Plane side = plane(i, j);
      result = std::max(result, side.normal.dot(p) - side.offset);
    }
    return result;
  }

  [[nodiscard]] std::vector<levelset::NarrowBand> solids(double voxel) const {
    std::vector<levelset::NarrowBand> result;
    for (std::size_t i = 0; i < kCells; ++i) {
      std::vector<Plane> planes;
      for (std::size_t j = 0; j < kCells; ++j)
        if (j != i && face(i, j).area > 1e-9) planes.push_back(plane(i, j));
      result.push_back(sampleBand(
          [&](const V3d& p) {
            double least = p.length() - 1;
            for (const Plane& side : planes)
              least = std::max(least, side.normal.dot(p) - side.offset);
            return least;
          },
          {V3d(-1), V3d(1)}, voxel));
    }
    return result;
  }

  /// Label of a position, and its least distance from an interface with another cell or the void.
  [[nodiscard]] std::pair<std::size_t, double> labelAt(const V3d& p) const {
    if (p.length() > 1) return {0, p.length() - 1};
    std::size_t best = 0;
    for (std::size_t i = 1; i < kCells; ++i)
      if (power(i, p) < power(best, p)) best = i;
    return {best + 1, -value(best, p)};
  }

  /// Interface between two cells: a polygon, cut by the ball.
  struct Face {
    double area = 0;
    double inner = 0;   ///< length of its border inside the ball
    double sphere = 0;  ///< length of its border on the sphere
  };
  [[nodiscard]] Face face(std::size_t i, std::size_t j) const {
    const Plane side = plane(i, j);
    Face result;
    if (std::abs(side.offset) >= 1) return result;
    const V3d x = side.normal.cross(std::abs(side.normal.x) < 0.6 ? V3d(1, 0, 0) : V3d(0, 1, 0))
                      .normalized(),
              y = side.normal.cross(x), centre = side.normal * side.offset;
    using Point = std::array<double, 2>;
    constexpr double kFar = 8;
    std::vector<Point> polygon = {{-kFar, -kFar}, {kFar, -kFar}, {kFar, kFar}, {-kFar, kFar}};
    for (std::size_t k = 0; k < kCells; ++k) {
      if (k == i || k == j) continue;
      const Plane cut = plane(i, k);
      const auto excess = [&](const Point& p) {
        return cut.normal.dot(centre + x * p[0] + y * p[1]) - cut.offset;
      };
      std::vector<Point> rest;
      for (std::size_t n = 0; n < polygon.size(); ++n) {
        const Point &a = polygon[n], &b = polygon[(n + 1) % polygon.size()];
        const double u = excess(a), v = excess(b);
        if (u < 0) rest.push_back(a);
        if ((u < 0) != (v < 0)) {
          const double t = u / (u - v);
          rest.push_back({a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])});
        }
      }
      polygon = rest;
    }
    // Triangles and sectors between the centre of the circle and each edge.
    const double square = 1 - side.offset * side.offset;
    for (std::size_t n = 0; n < polygon.size(); ++n) {
      const Point &a = polygon[n], &b = polygon[(n + 1) % polygon.size()];
      const Point d = {b[0] - a[0], b[1] - a[1]};
      const double dd = d[0] * d[0] + d[1] * d[1], ad = a[0] * d[0] + a[1] * d[1],
                   root = ad * ad - dd * (a[0] * a[0] + a[1] * a[1] - square);
      std::array<double, 4> ends = {0, 1, 1, 1};
      if (root > 0) {
        ends[1] = std::clamp((-ad - std::sqrt(root)) / dd, 0.0, 1.0);
        ends[2] = std::clamp((-ad + std::sqrt(root)) / dd, 0.0, 1.0);
      }
      for (std::size_t part = 0; part < 3; ++part) {
        if (!(ends[part] < ends[part + 1])) continue;
        const auto at = [&](double t) { return Point{a[0] + t * d[0], a[1] + t * d[1]}; };
        const Point p = at(ends[part]), q = at(ends[part + 1]);
        const double cross = p[0] * q[1] - p[1] * q[0], dot = p[0] * q[0] + p[1] * q[1];
        if (part == 1) {
          result.area += cross / 2;
          result.inner += std::hypot(q[0] - p[0], q[1] - p[1]);
        } else {
          const double angle = std::atan2(cross, dot);
          result.area += square * angle / 2;
          result.sphere += std::sqrt(square) * angle;
        }
      }
    }
    return result;
  }

  /// Area of a cell on the sphere. Heights are exact zones of the sphere, angles exact arcs; the
  /// sum over heights converges with second order.
  [[nodiscard]] double sphereArea(std::size_t i) const {
    constexpr int kHeights = 2000;
    double sum = 0;
    for (int n = 0; n < kHeights; ++n) {
      const double z = -1 + 2 * (n + 0.5) / kHeights, flat = std::sqrt(1 - z * z);
      std::vector<std::pair<double, double>> outside;  // arcs that belong to other cells
      bool isEmpty = false;
      for (std::size_t j = 0; j < kCells && !isEmpty; ++j) {
        if (j == i) continue;
        const Plane side = plane(i, j);
        const double size = flat * std::hypot(side.normal.x, side.normal.y),
                     limit = (side.offset - side.normal.z * z) / size;
        if (limit >= 1) continue;
        isEmpty = limit <= -1;
        const double half = std::acos(std::clamp(limit, -1.0, 1.0));
        double from = std::atan2(side.normal.y, side.normal.x) - half;
        from -= 2 * std::numbers::pi * std::floor(from / (2 * std::numbers::pi));
        const double to = from + 2 * half, all = 2 * std::numbers::pi;
        outside.emplace_back(from, std::min(to, all));
        if (to > all) outside.emplace_back(0, to - all);
      }
      if (isEmpty) continue;
      std::sort(outside.begin(), outside.end());
      double free = 0, last = 0;
      for (const auto& [from, to] : outside) {
        free += std::max(0.0, from - last);
        last = std::max(last, to);
      }
      sum += free + 2 * std::numbers::pi - last;
    }
    return sum * 2 / kHeights;
  }

  /// Volume of a cell: pyramids from the centre of the ball.
  [[nodiscard]] double volume(std::size_t i) const {
    double sum = sphereArea(i);
    for (std::size_t j = 0; j < kCells; ++j)
      if (j != i) sum += plane(i, j).offset * face(i, j).area;
    return sum / 3;
  }

  /// Distance of a position from the curve, or the point, in which regions meet.
  /// @param labels  three or four, 0 for the void, ascending
  [[nodiscard]] double distanceFromJunction(const V3d& p,
                                            const std::vector<std::size_t>& labels) const {
    V3d q = p;
    for (int n = 0; n < 20; ++n) {  // Gauss-Newton: the closest point of all surfaces
      std::vector<std::pair<V3d, double>> surfaces;
      const std::size_t first = labels.back() - 1;
      for (std::size_t k = 0; k + 1 < labels.size(); ++k) {
        if (labels[k] == 0) {
          surfaces.emplace_back(q.normalized(), 1 - q.length());
          continue;
        }
        const Plane side = plane(first, labels[k] - 1);
        surfaces.emplace_back(side.normal, side.offset - side.normal.dot(q));
      }
      // Projections onto the surfaces in turn, as orthogonal directions.
      V3d move(0);
      std::vector<V3d> directions;
      const V3d away = p - q;
      for (const auto& [normal, distance] : surfaces) {
        V3d direction = normal;
        for (const V3d& d : directions) direction -= d * direction.dot(d);
        direction.normalize();
        const double slope = direction.dot(normal);
        move += direction * ((distance - normal.dot(move)) / slope);
        directions.push_back(direction);
      }
      V3d along = away;
      for (const V3d& d : directions) along -= d * along.dot(d);
      q += move + along;
    }
    return (q - p).length();
  }

 private:
  [[nodiscard]] double power(std::size_t i, const V3d& p) const {
    return (p - sites_[i]).length2() - weights_[i];
  }

  // Found by a random search: all junction curves are longer than 0.15, and all interfaces meet the
  // sphere at more than 40°, so that no part is thinner than a voxel.
  std::array<V3d, kCells> sites_ = {
      {V3d(0.33, -0.04, 0.89),   V3d(-0.28, 0.25, 0.85),  V3d(0.3, -0.62, 0.8),
       V3d(0.32, -0.06, 0.22),   V3d(-0.99, -0.1, 0.67),  V3d(0.51, -0.49, 0.39),
       V3d(-0.52, 1.19, 0.54),   V3d(-0.18, -0.35, 0.09), V3d(0.95, 0.35, 0.13),
       V3d(-0.51, 0.17, -0.05),  V3d(0.68, -0.98, -0.18), V3d(0.18, 0.45, -0.1),
       V3d(-0.78, -0.42, -0.31), V3d(0.75, -0.42, -0.08), V3d(-0.52, 0.64, -0.58),
       V3d(-0.03, -0.34, -0.25), V3d(0.52, 0.56, -0.53),  V3d(-0.54, -0.08, -0.62),
       V3d(0.27, -0.42, -0.94),  V3d(-0.02, 0.16, -0.51)}};
  std::array<double, kCells> weights_ = {0.06,  0.16,  -0.04, -0.14, -0.13, -0.01, 0.06,
                                         -0.01, -0.11, 0,     0.09,  0.11,  -0.02, -0.13,
                                         -0.05, 0.09,  0.09,  -0.1,  -0.04, -0.03};
};

}  // namespace support
