#include "mapping/patches/relaxation.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "mapping/surface/surface_field.h"

namespace mapping {
namespace {

using Imath::V3d;

constexpr std::size_t kMaxIterations = 1000;
constexpr double kAtRest = 1e-3;  // voxels an iteration
// Twelve springs of unit stiffness pull at a particle: 1/12 is the longest step that cannot
// overshoot by more than the momentum takes back.
constexpr double kStep = 1.0 / 12;
constexpr double kMomentum = 0.8;

struct Spring {
  int columns, rows;  // to the neighbour
};
constexpr std::array<Spring, 12> kSprings = {{{1, 0},
                                              {-1, 0},
                                              {0, 1},
                                              {0, -1},  // structural
                                              {1, 1},
                                              {-1, 1},
                                              {1, -1},
                                              {-1, -1},  // shear
                                              {2, 0},
                                              {-2, 0},
                                              {0, 2},
                                              {0, -2}}};  // flexion

/// Lengths at rest: between the borders, the spacing goes over from one to the other.
struct RestLengths {
  std::vector<double> along;   // u spacing of each row
  std::vector<double> across;  // v spacing of each column

  explicit RestLengths(const ParticleLevel& level) {
    const auto rowLength = [&](std::size_t row) {
      double sum = 0;
      for (std::size_t i = 1; i < level.columns; ++i)
        sum += (level.at(i, row) - level.at(i - 1, row)).length();
      return sum / static_cast<double>(level.columns - 1);
    };
    const auto columnLength = [&](std::size_t column) {
      double sum = 0;
      for (std::size_t j = 1; j < level.rows; ++j)
        sum += (level.at(column, j) - level.at(column, j - 1)).length();
      return sum / static_cast<double>(level.rows - 1);
    };
    along = between(rowLength(0), rowLength(level.rows - 1), level.rows);
    across = between(columnLength(0), columnLength(level.columns - 1), level.columns);
  }

  static std::vector<double> between(double first, double last, std::size_t count) {
    std::vector<double> result(count);
    for (std::size_t i = 0; i < count; ++i)
      result[i] = std::lerp(first, last, static_cast<double>(i) / static_cast<double>(count - 1));
    return result;
  }
};

V3d springForce(const ParticleLevel& level, const RestLengths& rest, std::size_t column,
                std::size_t row) {
  const V3d p = level.at(column, row);
  V3d force(0);
  for (const Spring& spring : kSprings) {
    const long i = static_cast<long>(column) + spring.columns,
               j = static_cast<long>(row) + spring.rows;
    if (i < 0 || j < 0 || i >= static_cast<long>(level.columns) ||
        j >= static_cast<long>(level.rows))
      continue;
    const V3d way = level.at(static_cast<std::size_t>(i), static_cast<std::size_t>(j)) - p;
    const double length = way.length();
    if (length == 0) continue;
    const double u = spring.columns * rest.along[row], v = spring.rows * rest.across[column];
    force += way * (1 - std::sqrt(u * u + v * v) / length);
  }
  return force;
}

}  // namespace

Relaxation relax(const levelset::NarrowBand& band, ParticleLevel& level) {
  Relaxation result;
  if (level.columns < 3 || level.rows < 3) {
    result.isConverged = true;
    return result;
  }
  const RestLengths rest(level);
  const double voxel = band.voxelSize();
  const std::size_t count = level.positions.size();
  const double longest = 0.25 * std::min(*std::min_element(rest.along.begin(), rest.along.end()),
                                         *std::min_element(rest.across.begin(), rest.across.end()));
  std::vector<V3d> previous = level.positions, next = level.positions;
  while (result.iterations < kMaxIterations && !result.isConverged) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 64), [&](const auto& range) {
      const SurfaceField field(band);
      for (std::size_t n = range.begin(); n != range.end(); ++n) {
        const std::size_t column = n % level.columns, row = n / level.columns;
        if (column == 0 || row == 0 || column + 1 == level.columns || row + 1 == level.rows)
          continue;
        const V3d p = level.positions[n];
        V3d move = springForce(level, rest, column, row) * kStep + (p - previous[n]) * kMomentum;
        const V3d normal = field.normal(p);
        move -= normal * move.dot(normal);
        const double length = move.length();
        if (length > longest) move *= longest / length;
        V3d moved = p + move;
        next[n] = field.project(moved, level.height) ? moved : p;
      }
    });
    result.lastMove = 0;
    for (std::size_t n = 0; n < count; ++n)
      result.lastMove = std::max(result.lastMove, (next[n] - level.positions[n]).length() / voxel);
    previous.swap(level.positions);
    level.positions.swap(next);
    ++result.iterations;
    result.isConverged = result.lastMove <= kAtRest;
  }
  return result;
}

double cellAreaVariation(const ParticleLevel& level) {
  double sum = 0, squares = 0, count = 0;
  for (std::size_t j = 0; j + 1 < level.rows; ++j)
    for (std::size_t i = 0; i + 1 < level.columns; ++i) {
      const double area = 0.5 * (level.at(i + 1, j + 1) - level.at(i, j))
                                    .cross(level.at(i, j + 1) - level.at(i + 1, j))
                                    .length();
      sum += area;
      squares += area * area;
      ++count;
    }
  const double mean = sum / count;
  return mean > 0 ? std::sqrt(std::max(0.0, squares / count - mean * mean)) / mean : 0;
}

}  // namespace mapping
