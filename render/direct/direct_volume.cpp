#include "render/direct/direct_volume.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "render/direct/light_kernel.h"
#include "render/direct/light_tables.h"
#include "render/hit.h"

namespace render {
namespace {

using Imath::V3d;
using Imath::V3i;
using levelset::BlockRanges;
using levelset::Volume;

/// Optical depth of a piece above which it is split, so that light from its far end is absorbed.
constexpr double kDeepPiece = 0.1;

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

LightNumbers lightNumbers(const LightTables& tables, const VolumeShading* shading) {
  LightNumbers numbers{};
  numbers[kScaleSlope] = tables.volume.scale().slope;
  numbers[kScaleIntercept] = tables.volume.scale().intercept;
  numbers[kPieceTolerance] = tables.tolerance;
  numbers[kPiecesPerDepth] = 1 / kDeepPiece;
  numbers[kLeastPassed] = kLeastTransmittance;
  numbers[kPlainGradient] = tables.plainGradient;
  const VolumeShading plain;
  const VolumeShading& light = shading ? *shading : plain;
  numbers[kAmbientLight] = light.ambient;
  for (int axis = 0; axis < 3; ++axis) {
    numbers[static_cast<std::size_t>(kToLight + axis)] = light.toLight[axis];
    for (int to = 0; to < 3; ++to)
      numbers[static_cast<std::size_t>(kWorldToIndex + 3 * axis + to)] =
          tables.worldToIndex[axis][to];
  }
  return numbers;
}

DirectVolume::DirectVolume(const VolumeSurface& volume, std::vector<TransferPoint> points,
                           double tolerance)
    : transfer_(std::move(points), voxelOf(volume.volume())) {
  LightTables tables{.volume = volume.volume()};
  tables.blocks = volume.ranges().size();
  tables.groups = volume.ranges().groups();
  tables.pieceCount = transfer_.pieceCount();
  tables.pieces = transfer_.pieceNumbers();
  tables.tolerance = tolerance;
  tables.worldToIndex = volume.indexToWorld().inverse();
  const V3d spacing = tables.volume.grid().spacing();
  tables.plainGradient = 0.02 * (tables.volume.highest() - tables.volume.lowest()) /
                         std::max({spacing.x, spacing.y, spacing.z});
  const auto mark = [&](const std::vector<BlockRanges::Range>& ranges, std::vector<char>& marks) {
    marks.reserve(ranges.size());
    for (const BlockRanges::Range& range : ranges)
      marks.push_back(!transfer_.isEmptyBetween(static_cast<double>(range.low),
                                                static_cast<double>(range.high)));
  };
  mark(volume.ranges().blockValues(), tables.hasExtinction);
  mark(volume.ranges().groupValues(), tables.groupHasExtinction);
  tables_ = std::make_shared<const LightTables>(std::move(tables));
}

const Volume& DirectVolume::volume() const {
  return tables_->volume;
}

const Imath::M44d& DirectVolume::worldToIndex() const {
  return tables_->worldToIndex;
}

double DirectVolume::skippedShare() const {
  const std::vector<char>& marks = tables_->hasExtinction;
  if (marks.empty()) return 1;
  return static_cast<double>(std::count(marks.begin(), marks.end(), 0)) /
         static_cast<double>(marks.size());
}

double DirectVolume::brightness(const V3d& index, const VolumeShading& shading) const {
  const Volume& volume = tables_->volume;
  const V3i last = volume.size() - V3i(1);
  V3i cell;
  V3d share;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = std::clamp(static_cast<int>(index[axis]), 0, std::max(last[axis] - 1, 0));
    share[axis] = std::clamp(index[axis] - cell[axis], 0.0, 1.0);
  }
  const V3d slope =
      slopeAt([&](const V3i& p) { return volume.at(p.x, p.y, p.z); }, last, cell, share);
  // Gradients are transformed by the inverse transpose of the map from index to world space.
  const Imath::M44d& m = tables_->worldToIndex;
  const V3d gradient(m[0][0] * slope.x + m[0][1] * slope.y + m[0][2] * slope.z,
                     m[1][0] * slope.x + m[1][1] * slope.y + m[1][2] * slope.z,
                     m[2][0] * slope.x + m[2][1] * slope.y + m[2][2] * slope.z);
  const double size = gradient.length();
  if (!(size > 0)) return 1;
  // The outside has smaller values. A weak gradient is no surface and gets the full light.
  const double facing = std::max(0.0, -gradient.dot(shading.toLight) / size);
  const double strength = size / (size + tables_->plainGradient);
  return 1 - strength * (1 - shading.ambient) * (1 - facing);
}

LightStart DirectVolume::start(const VolumeSegment& segment) const {
  LightStart start;
  const V3i points = tables_->volume.size();
  const V3i& blocks = tables_->blocks;
  if (blocks.x == 0 || blocks.y == 0 || blocks.z == 0) return start;
  tables_->worldToIndex.multVecMatrix(segment.origin, start.from);
  tables_->worldToIndex.multDirMatrix(segment.direction, start.step);
  start.t = segment.near;
  start.end = segment.far;
  for (int axis = 0; axis < 3; ++axis) {
    const double last = points[axis] - 1, from = start.from[axis], step = start.step[axis];
    if (step == 0) {
      if (!(from >= 0 && from <= last)) return start;
      continue;
    }
    const double a = -from * (1 / step), b = (last - from) * (1 / step);
    start.t = std::max(start.t, std::min(a, b));
    start.end = std::min(start.end, std::max(a, b));
  }
  for (int axis = 0; axis < 3; ++axis)
    start.cell[axis] =
        std::clamp(static_cast<int>(std::floor(start.from[axis] + start.step[axis] * start.t)), 0,
                   points[axis] - 2);
  start.isInside = start.t < start.end;
  return start;
}

VolumeLight DirectVolume::light(const V3d& origin, const V3d& direction, double near, double far,
                                const VolumeShading* shading) const {
  const LightStart first = start({origin, direction, near, far});
  if (!first.isInside) return {};
  return levelset::withStoredType(tables_->volume.type(), [&](auto number) {
    using Kernel = LightKernel<decltype(number)>;
    Kernel kernel(*tables_, shading);
    typename Kernel::VolumeRay ray = Kernel::rayOf(first);
    kernel.follow(ray, std::numeric_limits<int>::max());
    return VolumeLight{V3d(ray.red, ray.green, ray.blue), ray.passed};
  });
}

}  // namespace render
