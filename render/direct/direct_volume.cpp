#include "render/direct/direct_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "levelset/volumes/volume_numbers.h"
#include "render/scene/scene.h"

namespace render {
namespace {

using Imath::V3d;
using Imath::V3i;
using levelset::BlockRanges;
using levelset::Volume;

/// Optical depth of a piece above which it is split, so that light from its far end is absorbed.
constexpr double kDeepPiece = 0.1;
// Only peaks of the transfer function that are thinner than 1e-4 of the values in a cell need more.
constexpr int kMostPieces = 4096;

/// Values of the trilinear interpolant along a segment of a cell, as a cubic in Bernstein form.
using Cubic = std::array<double, 4>;

double between(double a, double b, double t) {
  return a + (b - a) * t;
}

/// Trilinear interpolation with three different points for the three axes: a blossom.
double blossomAt(const std::array<double, 8>& f, double x, double y, double z) {
  return between(between(between(f[0], f[4], x), between(f[2], f[6], x), y),
                 between(between(f[1], f[5], x), between(f[3], f[7], x), y), z);
}

Cubic cubicOf(const std::array<double, 8>& f, const V3d& a, const V3d& b) {
  return {
      blossomAt(f, a.x, a.y, a.z),
      (blossomAt(f, b.x, a.y, a.z) + blossomAt(f, a.x, b.y, a.z) + blossomAt(f, a.x, a.y, b.z)) / 3,
      (blossomAt(f, b.x, b.y, a.z) + blossomAt(f, b.x, a.y, b.z) + blossomAt(f, a.x, b.y, b.z)) / 3,
      blossomAt(f, b.x, b.y, b.z)};
}

double cubicAt(const Cubic& b, double t) {
  const double s = 1 - t;
  return s * s * (s * b[0] + 3 * t * b[1]) + t * t * (3 * s * b[2] + t * b[3]);
}

/// Light of a ray so far.
struct LightSum {
  VolumeLight light;

  /// Adds a piece on which the values go linearly from `from` to `to`. @param length  world units
  void addLinear(const TransferFunction& transfer, double from, double to, double length,
                 double brightness) {
    transfer.alongRun(from, to, [&](const TransferFunction::Part& part) {
      if (!(part.extinction > 0)) return;
      const double absorbed = -std::expm1(-part.extinction * part.share * length);
      light.colour +=
          part.emission * (brightness * light.transmittance * absorbed / part.extinction);
      light.transmittance *= 1 - absorbed;
    });
  }
};

/// Slope of the values in a cell, per grid spacing: central differences at its corners, one-sided
/// at the border of the grid, interpolated. @param numberAt  stored number of a grid point
template <typename NumberAt>
V3d slopeAt(const NumberAt& numberAt, const V3i& last, const V3i& cell, const V3d& share) {
  V3d slope(0);
  for (int corner = 0; corner < 8; ++corner) {
    const int offset[3] = {corner >> 2, corner >> 1 & 1, corner & 1};
    double weight = 1;
    V3i at = cell;
    for (int axis = 0; axis < 3; ++axis) {
      weight *= offset[axis] ? share[axis] : 1 - share[axis];
      at[axis] = std::min(cell[axis] + offset[axis], last[axis]);
    }
    for (int axis = 0; axis < 3; ++axis) {
      V3i low = at, high = at;
      low[axis] = std::max(at[axis] - 1, 0);
      high[axis] = std::min(at[axis] + 1, last[axis]);
      if (high[axis] > low[axis])
        slope[axis] += weight * (numberAt(high) - numberAt(low)) / (high[axis] - low[axis]);
    }
  }
  return slope;
}

double voxelOf(const Volume& volume) {
  const V3d spacing = volume.grid().spacing();
  return std::min({spacing.x, spacing.y, spacing.z});
}

}  // namespace

DirectVolume::DirectVolume(const VolumeSurface& volume, std::vector<TransferPoint> points,
                           double tolerance)
    : volume_(volume.volume()),
      transfer_(std::move(points), voxelOf(volume_)),
      tolerance_(tolerance),
      worldToIndex_(volume.indexToWorld().inverse()),
      blocks_(volume.ranges().size()),
      groups_(volume.ranges().groups()) {
  const V3d spacing = volume_.grid().spacing();
  plainGradient_ =
      0.02 * (volume_.highest() - volume_.lowest()) / std::max({spacing.x, spacing.y, spacing.z});
  const auto mark = [&](const std::vector<BlockRanges::Range>& ranges, std::vector<char>& marks) {
    marks.reserve(ranges.size());
    for (const BlockRanges::Range& range : ranges)
      marks.push_back(!transfer_.isEmptyBetween(static_cast<double>(range.low),
                                                static_cast<double>(range.high)));
  };
  mark(volume.ranges().blockValues(), hasExtinction_);
  mark(volume.ranges().groupValues(), groupHasExtinction_);
}

double DirectVolume::skippedShare() const {
  if (hasExtinction_.empty()) return 1;
  return static_cast<double>(std::count(hasExtinction_.begin(), hasExtinction_.end(), 0)) /
         static_cast<double>(hasExtinction_.size());
}

double DirectVolume::brightness(const V3d& index, const VolumeShading& shading) const {
  const V3i last = volume_.size() - V3i(1);
  V3i cell;
  V3d share;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = std::clamp(static_cast<int>(index[axis]), 0, std::max(last[axis] - 1, 0));
    share[axis] = std::clamp(index[axis] - cell[axis], 0.0, 1.0);
  }
  return brightnessOf(
      slopeAt([&](const V3i& p) { return volume_.at(p.x, p.y, p.z); }, last, cell, share), shading);
}

double DirectVolume::brightnessOf(const V3d& slope, const VolumeShading& shading) const {
  // Gradients are transformed by the inverse transpose of the map from index to world space.
  const Imath::M44d& m = worldToIndex_;
  const V3d gradient(m[0][0] * slope.x + m[0][1] * slope.y + m[0][2] * slope.z,
                     m[1][0] * slope.x + m[1][1] * slope.y + m[1][2] * slope.z,
                     m[2][0] * slope.x + m[2][1] * slope.y + m[2][2] * slope.z);
  const double size = gradient.length();
  if (!(size > 0)) return 1;
  // The outside has smaller values. A weak gradient is no surface and gets the full light.
  const double facing = std::max(0.0, -gradient.dot(shading.toLight) / size);
  const double strength = size / (size + plainGradient_);
  return 1 - strength * (1 - shading.ambient) * (1 - facing);
}

template <typename Number>
VolumeLight DirectVolume::lightOf(const V3d& origin, const V3d& direction, double near, double far,
                                  const VolumeShading* shading) const {
  LightSum sum;
  const V3i points = volume_.size();
  if (blocks_.x == 0 || blocks_.y == 0 || blocks_.z == 0) return sum.light;
  V3d from, step;
  worldToIndex_.multVecMatrix(origin, from);
  worldToIndex_.multDirMatrix(direction, step);
  double t = near, end = far;
  const V3d perStep(1 / step.x, 1 / step.y, 1 / step.z);
  for (int axis = 0; axis < 3; ++axis) {
    const double last = points[axis] - 1;
    if (step[axis] == 0) {
      if (!(from[axis] >= 0 && from[axis] <= last)) return sum.light;
      continue;
    }
    const double a = -from[axis] * perStep[axis], b = (last - from[axis]) * perStep[axis];
    t = std::max(t, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  if (!(t < end)) return sum.light;

  // Moves to the cell or block behind the plane where the ray leaves the box of cells
  // [low, low + size), and returns the distance of that plane.
  V3i cell;
  for (int axis = 0; axis < 3; ++axis)
    cell[axis] =
        std::clamp(static_cast<int>(std::floor(from[axis] + step[axis] * t)), 0, points[axis] - 2);
  bool isOutside = false;
  const auto leave = [&](const V3i& low, int size) {
    double exit = end;
    int across = -1;
    for (int axis = 0; axis < 3; ++axis) {
      if (step[axis] == 0) continue;
      const double plane = step[axis] > 0 ? low[axis] + size : low[axis];
      const double at = (plane - from[axis]) * perStep[axis];
      if (at < exit) {
        exit = at;
        across = axis;
      }
    }
    exit = std::max(exit, t);
    if (across < 0) {
      isOutside = true;
      return exit;
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (axis == across)
        cell[axis] = step[axis] > 0 ? low[axis] + size : low[axis] - 1;
      else if (size > 1)
        cell[axis] = std::clamp(static_cast<int>(std::floor(from[axis] + step[axis] * exit)),
                                low[axis], low[axis] + size - 1);
      isOutside = isOutside || cell[axis] < 0 || cell[axis] > points[axis] - 2;
    }
    return exit;
  };

  const char* numbers = volume_.numbers();
  const std::size_t strides[3] = {
      sizeof(Number), sizeof(Number) * static_cast<std::size_t>(points.x),
      sizeof(Number) * static_cast<std::size_t>(points.x) * static_cast<std::size_t>(points.y)};
  const levelset::VolumeScale scale = volume_.scale();
  const auto numberAt = [&](const V3i& p) {
    return static_cast<double>(levelset::loadNumber<Number>(
        numbers + static_cast<std::size_t>(p.x) * strides[0] +
        static_cast<std::size_t>(p.y) * strides[1] + static_cast<std::size_t>(p.z) * strides[2]));
  };
  while (!isOutside && t < end) {
    const V3i block(cell.x >> 3, cell.y >> 3, cell.z >> 3);
    const V3i group(block.x >> 3, block.y >> 3, block.z >> 3);
    const auto isSkipped = [](const std::vector<char>& marks, const V3i& at, const V3i& size) {
      return !marks[static_cast<std::size_t>((at.x * size.y + at.y) * size.z + at.z)];
    };
    if (isSkipped(groupHasExtinction_, group, groups_)) {
      t = leave(group * 64, 64);
      continue;
    }
    if (isSkipped(hasExtinction_, block, blocks_)) {
      t = leave(block * 8, 8);
      continue;
    }
    const char* corner = numbers + static_cast<std::size_t>(cell.x) * strides[0] +
                         static_cast<std::size_t>(cell.y) * strides[1] +
                         static_cast<std::size_t>(cell.z) * strides[2];
    std::array<double, 8> f{};
    for (std::size_t n = 0; n < 8; ++n)
      f[n] = scale(static_cast<double>(levelset::loadNumber<Number>(
          corner + (n >> 2) * strides[0] + (n >> 1 & 1) * strides[1] + (n & 1) * strides[2])));
    const V3i cellBefore = cell;
    const V3d low(cell);
    const double start = t;
    t = leave(cell, 1);
    const double length = t - start;
    const auto [least, most] = std::minmax_element(f.begin(), f.end());
    const TransferFunction::Bounds bounds = transfer_.boundsBetween(*least, *most);
    if (!(length > 0) || bounds.extinction == 0) continue;
    const auto local = [&](double at) {
      V3d p = from + step * at - low;
      for (int axis = 0; axis < 3; ++axis) p[axis] = std::clamp(p[axis], 0.0, 1.0);
      return p;
    };
    const Cubic cubic = cubicOf(f, local(start), local(t));
    const double brightness = shading ? brightnessOf(slopeAt(numberAt, points - V3i(1), cellBefore,
                                                             local(0.5 * (start + t))) *
                                                         scale.slope,
                                                     *shading)
                                      : 1;
    // The mean of a cubic on its linear pieces differs by half its second difference over n².
    const double bend = std::max(std::abs(cubic[0] - 2 * cubic[1] + cubic[2]),
                                 std::abs(cubic[1] - 2 * cubic[2] + cubic[3]));
    const double linear = std::sqrt(0.5 * bend * bounds.slope * length / tolerance_);
    const double wanted =
        std::ceil(std::max({linear, bounds.extinction * length / kDeepPiece, 1.0}));
    const int pieces = static_cast<int>(std::min(wanted, static_cast<double>(kMostPieces)));
    double value = cubic[0];
    for (int n = 1; n <= pieces && sum.light.transmittance >= kLeastTransmittance; ++n) {
      const double next = n == pieces ? cubic[3] : cubicAt(cubic, static_cast<double>(n) / pieces);
      sum.addLinear(transfer_, value, next, length / pieces, brightness);
      value = next;
    }
    if (sum.light.transmittance < kLeastTransmittance) {
      // As for surfaces, the last point counts as opaque.
      sum.light.colour *= 1 / (1 - sum.light.transmittance);
      sum.light.transmittance = 0;
      break;
    }
  }
  return sum.light;
}

VolumeLight DirectVolume::light(const V3d& origin, const V3d& direction, double near, double far,
                                const VolumeShading* shading) const {
  return levelset::withStoredType(volume_.type(), [&](auto number) {
    return lightOf<decltype(number)>(origin, direction, near, far, shading);
  });
}

}  // namespace render
