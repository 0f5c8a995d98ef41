#include "levelset/points/field/multilevel_partition.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "levelset/memory/memory_limit.h"
#include "levelset/points/field/local_quadric.h"

namespace levelset::points {
namespace {

using Imath::V3d;

// Parameters of [Ohtake03]: radius of a cell's support in its diagonals, the cosine of normals on
// two sides of an edge, and that of a corner's third side.
constexpr double kSupport = 0.75, kEdgeCosine = 0.8, kCornerSine = 0.7;
constexpr int kMostLevels = 20;

enum class Joint { None, Convex, Concave };

/// Functions of a cell: one, or several that meet in an edge or a corner.
struct CellSurface {
  std::array<LocalQuadric, 3> sides;
  int count = 0;
  Joint joint = Joint::None;

  [[nodiscard]] double distance(const V3d& at) const {
    double distance = sides[0].distance(at);
    for (int n = 1; n < count; ++n) {
      const double other = sides[static_cast<std::size_t>(n)].distance(at);
      distance = joint == Joint::Convex ? std::max(distance, other) : std::min(distance, other);
    }
    return distance;
  }
};

struct PartitionCell {
  V3d centre;
  double half = 0;             ///< half of the edge
  double support = 0;          ///< radius of the blending weight
  double reach = 0;            ///< largest distance from the centre to the end of a support below
  std::uint32_t children = 0;  ///< first of eight; 0: a leaf
  std::uint32_t surface = 0;
};

/// Quadratic B-spline of the distance in fractions of the support [Ohtake03].
double splineWeight(double t) {
  const double s = 1.5 * t;
  if (s < 0.5) return 0.75 - s * s;
  return s < 1.5 ? (1.5 - s) * (1.5 - s) / 2 : 0;
}

class CellFitter {
 public:
  CellFitter(const OrientedPoints& points, std::size_t fewest, double tolerance)
      : points_(points), fewest_(fewest), tolerance_(tolerance) {}

  /// Fits the functions of a cell, and sets its support.
  /// @return false if the cell is to be split
  bool fit(PartitionCell& cell, bool isLast, CellSurface& surface,
           std::vector<FoundItem>& found) const {
    cell.support = kSupport * 2 * cell.half * std::sqrt(3.0);
    points_.search.within(cell.centre, cell.support * cell.support, found);
    // A cell with many points is split anyway.
    constexpr std::size_t kMany = 8;
    if (found.size() > kMany * fewest_ && !isLast) return false;
    const bool isSmall = found.size() <= 2 * fewest_ || isLast;
    if (found.size() < fewest_) {
      points_.search.closest(cell.centre, fewest_, found);
      // No further: the function would be extrapolated to points that it was not fitted to. On a
      // sphere, cells in the middle would have weight on half of the surface.
      cell.support = std::max(cell.support, std::sqrt(found.back().squared));
    }
    surface = smooth(cell, found);
    double error = errorOf(surface, found);
    if (error <= tolerance_) return true;
    CellSurface sharp;
    if (fitSides(cell, found, sharp)) {
      const double sharpError = errorOf(sharp, found);
      if (sharpError < error) {
        surface = sharp;
        error = sharpError;
      }
    }
    return error <= tolerance_ || isSmall;
  }

 private:
  [[nodiscard]] double weight(const PartitionCell& cell, const FoundItem& f) const {
    // Points at the rim of a support that was enlarged for them still count.
    constexpr double kLeast = 0.02;
    return std::max(splineWeight(std::sqrt(f.squared) / cell.support), kLeast);
  }

  template <class Choose>
  [[nodiscard]] LocalQuadric quadric(const PartitionCell& cell, const std::vector<FoundItem>& found,
                                     const Choose& isChosen) const {
    V3d centre(0), normal(0);
    double weights = 0, radius = 0;
    for (std::size_t n = 0; n < found.size(); ++n) {
      if (!isChosen(n)) continue;
      const double w = weight(cell, found[n]);
      weights += w;
      centre += w * points_.positions[found[n].index];
      normal += w * points_.normals[found[n].index];
    }
    centre /= weights;
    for (std::size_t n = 0; n < found.size(); ++n)
      if (isChosen(n))
        radius = std::max(radius, (points_.positions[found[n].index] - centre).length());
    normal = normal.length() > 0 ? normal.normalized() : V3d(0, 0, 1);
    QuadricFit fit(centre, normal, radius > 0 ? radius : cell.support);
    for (std::size_t n = 0; n < found.size(); ++n)
      if (isChosen(n))
        fit.add(points_.positions[found[n].index], points_.normals[found[n].index],
                weight(cell, found[n]));
    return fit.solve();
  }

  [[nodiscard]] CellSurface smooth(const PartitionCell& cell,
                                   const std::vector<FoundItem>& found) const {
    CellSurface surface;
    surface.sides[0] = quadric(cell, found, [](std::size_t) { return true; });
    surface.count = 1;
    return surface;
  }

  /// Largest distance of the points from the surface.
  [[nodiscard]] double errorOf(const CellSurface& surface,
                               const std::vector<FoundItem>& found) const {
    double error = 0;
    for (const FoundItem& f : found)
      error = std::max(error, std::abs(surface.distance(points_.positions[f.index])));
    return error;
  }

  /// Sorts the points by their normals to two or three sides of an edge or a corner
  /// [Kobbelt01, Ohtake03], and fits each side.
  [[nodiscard]] bool fitSides(const PartitionCell& cell, const std::vector<FoundItem>& found,
                              CellSurface& surface) const {
    const auto normal = [&](std::size_t n) -> const V3d& {
      return points_.normals[found[n].index];
    };
    std::array<std::size_t, 2> extremes{};
    double least = kEdgeCosine;
    for (std::size_t i = 0; i < found.size(); ++i)
      for (std::size_t j = i + 1; j < found.size(); ++j)
        if (const double cosine = normal(i).dot(normal(j)); cosine < least) {
          least = cosine;
          extremes = {i, j};
        }
    if (least >= kEdgeCosine) return false;
    const V3d &first = normal(extremes[0]), &second = normal(extremes[1]);
    const V3d across = first.cross(second).normalized();
    std::vector<int> side(found.size());
    std::array<std::size_t, 3> sizes{};
    int sign = 0;  // of the third side
    for (std::size_t n = 0; n < found.size(); ++n) {
      const double third = normal(n).dot(across);
      if (std::abs(third) > kCornerSine) {
        const int own = third > 0 ? 1 : -1;
        if (sign != 0 && own != sign) return false;  // four sides
        sign = own;
        side[n] = 2;
      } else {
        side[n] = normal(n).dot(first) >= normal(n).dot(second) ? 0 : 1;
      }
      ++sizes[static_cast<std::size_t>(side[n])];
    }
    // A side of a few points has a plane only by their normals.
    constexpr std::size_t kFewestOnSide = 3;
    surface.count = sizes[2] > 0 ? 3 : 2;
    for (int n = 0; n < surface.count; ++n) {
      if (sizes[static_cast<std::size_t>(n)] < kFewestOnSide) return false;
      surface.sides[static_cast<std::size_t>(n)] =
          quadric(cell, found, [&](std::size_t k) { return side[k] == n; });
    }
    // The sides of a convex edge lie behind each other.
    for (int n = 0; n < surface.count; ++n)
      for (int m = 0; m < surface.count; ++m) {
        if (n == m) continue;
        const LocalQuadric &a = surface.sides[static_cast<std::size_t>(n)],
                           &b = surface.sides[static_cast<std::size_t>(m)];
        const Joint joint =
            (b.centre - a.centre).dot(a.normal) < 0 ? Joint::Convex : Joint::Concave;
        if (surface.joint != Joint::None && joint != surface.joint) return false;  // a saddle
        surface.joint = joint;
      }
    return true;
  }

  const OrientedPoints& points_;
  std::size_t fewest_;
  double tolerance_;
};

struct MultilevelPartition {
  std::vector<PartitionCell> cells;
  std::vector<CellSurface> surfaces;

  /// Blended value at a position; NaN where no support reaches.
  [[nodiscard]] double value(const V3d& at) const {
    double sum = 0, weights = 0;
    std::array<std::uint32_t, 8 * kMostLevels> stack;
    std::size_t top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const PartitionCell& cell = cells[stack[--top]];
      const double distance = (at - cell.centre).length();
      if (distance >= cell.reach) continue;
      if (cell.children > 0) {
        for (std::uint32_t n = 8; n-- > 0;) stack[top++] = cell.children + n;
      } else if (const double weight = splineWeight(distance / cell.support); weight > 0) {
        weights += weight;
        sum += weight * surfaces[cell.surface].distance(at);
      }
    }
    return sum / weights;
  }
};

}  // namespace

PointField multilevelPartition(const OrientedPoints& points, std::size_t neighbours,
                               double tolerance, std::size_t maxMemory, const Progress& progress) {
  const auto partition = std::make_shared<MultilevelPartition>();
  const std::size_t fewest = std::min(neighbours, points.size());
  const CellFitter fitter(points, fewest, tolerance);
  const V3d size = points.box.size();
  partition->cells.push_back({points.box.center(), std::max({size.x, size.y, size.z}) / 2 * 1.01});
  // Level by level, so that cells have the same order for any number of threads.
  std::size_t begin = 0;
  for (int level = 0; begin < partition->cells.size(); ++level) {
    const std::size_t end = partition->cells.size();
    std::vector<CellSurface> surfaces(end - begin);
    std::vector<char> isLeaf(end - begin);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end), [&](const auto& range) {
      std::vector<FoundItem> found;
      for (std::size_t i = range.begin(); i < range.end(); ++i)
        isLeaf[i - begin] =
            fitter.fit(partition->cells[i], level + 1 == kMostLevels, surfaces[i - begin], found);
    });
    for (std::size_t i = begin; i < end; ++i) {
      if (isLeaf[i - begin]) {
        partition->cells[i].surface = static_cast<std::uint32_t>(partition->surfaces.size());
        partition->surfaces.push_back(surfaces[i - begin]);
        continue;
      }
      const PartitionCell cell = partition->cells[i];
      partition->cells[i].children = static_cast<std::uint32_t>(partition->cells.size());
      for (int n = 0; n < 8; ++n) {
        const V3d towards(n & 4 ? 1 : -1, n & 2 ? 1 : -1, n & 1 ? 1 : -1);
        partition->cells.push_back({cell.centre + cell.half / 2 * towards, cell.half / 2});
      }
    }
    requireMemory(static_cast<double>(partition->cells.size() * sizeof(PartitionCell) +
                                      2 * partition->surfaces.size() * sizeof(CellSurface)),
                  memoryLeft(memoryLimit(maxMemory)));
    begin = end;
    report(progress, 1 - 1 / (1.0 + level));
  }
  for (std::size_t i = partition->cells.size(); i-- > 0;) {
    PartitionCell& cell = partition->cells[i];
    cell.reach = cell.support;
    if (cell.children == 0) continue;
    cell.reach = 0;
    for (std::uint32_t n = 0; n < 8; ++n) {
      const PartitionCell& child = partition->cells[cell.children + n];
      cell.reach = std::max(cell.reach, (child.centre - cell.centre).length() + child.reach);
    }
  }
  return {[partition, &points](const V3d& at, const std::vector<FoundItem>& found) {
            const double value = partition->value(at);
            if (std::isfinite(value)) return value;
            const std::uint32_t first = found.front().index;  // outside all supports
            return points.normals[first].dot(at - points.positions[first]);
          },
          2};
}

}  // namespace levelset::points
