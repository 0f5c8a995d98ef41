#include "mapping/layers/relaxation.h"

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
// Largest displacement of any particle in an iteration after which the layer counts as at rest,
// voxels.
constexpr double kAtRest = 1e-3;
// Twelve springs of unit stiffness act on a particle. 1/12 is the longest step whose overshoot the
// momentum can compensate.
constexpr double kStep = 1.0 / 12;
constexpr double kMomentum = 0.8;

double fractionOf(std::size_t k, std::size_t count) {
  return static_cast<double>(k) / static_cast<double>(count - 1);
}

/// Bilinear interpolation of values at the particles, at fractions u, v (0 to 1) of a layer's
/// columns and rows.
struct Between {
  std::size_t corner, columns;
  double s, t;

  Between(const ParticleLayer& layer, double u, double v) : columns(layer.columns) {
    const auto split = [](double share, std::size_t count, double& rest) {
      const double x = share * static_cast<double>(count - 1);
      const auto first = std::min(static_cast<std::size_t>(x), count - 2);
      rest = x - static_cast<double>(first);
      return first;
    };
    const std::size_t i = split(u, layer.columns, s), j = split(v, layer.rows, t);
    corner = j * columns + i;
  }
  [[nodiscard]] V3d of(const std::vector<V3d>& values) const {
    const V3d low = values[corner] * (1 - s) + values[corner + 1] * s;
    const V3d high = values[corner + columns] * (1 - s) + values[corner + columns + 1] * s;
    return low * (1 - t) + high * t;
  }
};

struct Spring {
  int columns, rows;  // offset of the neighbouring particle in the grid of the layer
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

/// Rest lengths of the springs. They are interpolated linearly between the mean spacings of the
/// particles on two opposite borders.
struct RestLengths {
  /// Element 0: springs between neighbours. Element 1: springs between particles two apart; on a
  /// bent surface these are less than twice as long.
  std::array<std::vector<double>, 2> along;   // along u, for each row
  std::array<std::vector<double>, 2> across;  // along v, for each column

  explicit RestLengths(const ParticleLayer& layer) {
    const auto rowChord = [&](std::size_t row, std::size_t apart) {
      double sum = 0;
      for (std::size_t i = apart; i < layer.columns; ++i)
        sum += (layer.at(i, row) - layer.at(i - apart, row)).length();
      return sum / static_cast<double>(layer.columns - apart);
    };
    const auto columnChord = [&](std::size_t column, std::size_t apart) {
      double sum = 0;
      for (std::size_t j = apart; j < layer.rows; ++j)
        sum += (layer.at(column, j) - layer.at(column, j - apart)).length();
      return sum / static_cast<double>(layer.rows - apart);
    };
    for (const std::size_t apart : {1u, 2u}) {
      along[apart - 1] = between(rowChord(0, apart), rowChord(layer.rows - 1, apart), layer.rows);
      across[apart - 1] =
          between(columnChord(0, apart), columnChord(layer.columns - 1, apart), layer.columns);
    }
  }

  [[nodiscard]] double of(const Spring& spring, std::size_t column, std::size_t row) const {
    const auto length = [](int apart, const std::array<std::vector<double>, 2>& chords,
                           std::size_t n) {
      return apart == 0 ? 0 : chords[apart * apart > 1 ? 1 : 0][n];
    };
    return std::hypot(length(spring.columns, along, row), length(spring.rows, across, column));
  }

  static std::vector<double> between(double first, double last, std::size_t count) {
    std::vector<double> result(count);
    for (std::size_t i = 0; i < count; ++i)
      result[i] = std::lerp(first, last, fractionOf(i, count));
    return result;
  }
};

V3d springForce(const ParticleLayer& layer, const RestLengths& rest, std::size_t column,
                std::size_t row, bool isRing) {
  const long around = static_cast<long>(layer.columns) - 1;
  const V3d p = layer.at(column, row);
  V3d force(0);
  for (const Spring& spring : kSprings) {
    long i = static_cast<long>(column) + spring.columns;
    const long j = static_cast<long>(row) + spring.rows;
    if (isRing) i = (i + around) % around;
    if (i < 0 || j < 0 || i >= static_cast<long>(layer.columns) ||
        j >= static_cast<long>(layer.rows))
      continue;
    const V3d offset = layer.at(static_cast<std::size_t>(i), static_cast<std::size_t>(j)) - p;
    const double length = offset.length();
    if (length == 0) continue;
    force += offset * (1 - rest.of(spring, column, row) / length);
  }
  return force;
}

/// Resamples a layer to half as many rows and columns.
ParticleLayer coarsened(const SurfaceField& field, const ParticleLayer& fine) {
  ParticleLayer coarse = fine;
  coarse.rim.clear();
  coarse.columns = (fine.columns + 1) / 2;
  coarse.rows = (fine.rows + 1) / 2;
  coarse.positions.assign(coarse.columns * coarse.rows, V3d(0));
  for (std::size_t j = 0; j < coarse.rows; ++j)
    for (std::size_t i = 0; i < coarse.columns; ++i) {
      const Between place(fine, fractionOf(i, coarse.columns), fractionOf(j, coarse.rows));
      V3d& p = coarse.positions[j * coarse.columns + i];
      p = place.of(fine.positions);
      V3d projected = p;
      if (field.project(projected, fine.height)) p = projected;
    }
  return coarse;
}

/// Copies the first column to the last one, which is the same column of a closed ring.
void closeRing(std::vector<V3d>& positions, std::size_t columns) {
  for (std::size_t n = 0; n < positions.size(); n += columns)
    positions[n + columns - 1] = positions[n];
}

Relaxation settle(const levelset::NarrowBand& band, ParticleLayer& layer, bool isRing);

/// Corrects long-range displacements on coarser copies of the layer first, because springs
/// propagate them by only one particle per iteration.
void settleCoarsely(const levelset::NarrowBand& band, ParticleLayer& layer, bool isRing) {
  constexpr std::size_t kFewestToCoarsen = 8;
  if (std::min(layer.columns, layer.rows) < kFewestToCoarsen) return;
  const SurfaceField field(band);
  ParticleLayer coarse = coarsened(field, layer);
  std::vector<V3d> moves = coarse.positions;
  settleCoarsely(band, coarse, isRing);
  (void)settle(band, coarse, isRing);
  for (std::size_t n = 0; n < moves.size(); ++n) moves[n] = coarse.positions[n] - moves[n];
  for (std::size_t j = 1; j + 1 < layer.rows; ++j)
    for (std::size_t i = isRing ? 0 : 1; i + 1 < layer.columns; ++i) {
      const Between place(coarse, fractionOf(i, layer.columns), fractionOf(j, layer.rows));
      V3d& p = layer.positions[j * layer.columns + i];
      V3d moved = p + place.of(moves);
      if (field.project(moved, layer.height)) p = moved;
    }
  if (isRing) closeRing(layer.positions, layer.columns);
}

Relaxation settle(const levelset::NarrowBand& band, ParticleLayer& layer, bool isRing) {
  Relaxation result;
  const RestLengths rest(layer);
  const double voxel = band.voxelSize();
  const std::size_t count = layer.positions.size();
  const double longest =
      0.25 * std::min(*std::min_element(rest.along[0].begin(), rest.along[0].end()),
                      *std::min_element(rest.across[0].begin(), rest.across[0].end()));
  std::vector<V3d> previous = layer.positions, next = layer.positions;
  while (result.iterations < kMaxIterations && !result.isConverged) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 64), [&](const auto& range) {
      const SurfaceField field(band);
      for (std::size_t n = range.begin(); n != range.end(); ++n) {
        const std::size_t column = n % layer.columns, row = n / layer.columns;
        if (row == 0 || row + 1 == layer.rows || column + 1 == layer.columns) continue;
        if (column == 0 && !isRing) continue;
        const V3d p = layer.positions[n];
        V3d move =
            springForce(layer, rest, column, row, isRing) * kStep + (p - previous[n]) * kMomentum;
        const V3d normal = field.normal(p);
        move -= normal * move.dot(normal);
        const double length = move.length();
        if (length > longest) move *= longest / length;
        V3d moved = p + move;
        next[n] = field.project(moved, layer.height) ? moved : p;
      }
    });
    if (isRing) closeRing(next, layer.columns);
    result.lastMove = 0;
    for (std::size_t n = 0; n < count; ++n)
      result.lastMove = std::max(result.lastMove, (next[n] - layer.positions[n]).length() / voxel);
    previous.swap(layer.positions);
    layer.positions.swap(next);
    ++result.iterations;
    result.isConverged = result.lastMove <= kAtRest;
  }
  return result;
}

}  // namespace

Relaxation relax(const levelset::NarrowBand& band, ParticleLayer& layer, bool isRing) {
  if (layer.columns < 3 || layer.rows < 3) return {.isConverged = true};
  settleCoarsely(band, layer, isRing);
  return settle(band, layer, isRing);
}

double cellAreaVariation(const ParticleLayer& layer) {
  double sum = 0, squares = 0, count = 0;
  for (std::size_t j = 0; j + 1 < layer.rows; ++j)
    for (std::size_t i = 0; i + 1 < layer.columns; ++i) {
      const double area = 0.5 * (layer.at(i + 1, j + 1) - layer.at(i, j))
                                    .cross(layer.at(i, j + 1) - layer.at(i + 1, j))
                                    .length();
      sum += area;
      squares += area * area;
      ++count;
    }
  const double mean = sum / count;
  return mean > 0 ? std::sqrt(std::max(0.0, squares / count - mean * mean)) / mean : 0;
}

}  // namespace mapping
