#include "render/volumes/volume_surface.h"

#include <fmt/core.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "levelset/error.h"
#include "levelset/splines/grid_extension.h"

namespace render {
namespace {

using Imath::V3d;
using Imath::V3i;

constexpr int kVolumeBlock = levelset::BlockRanges::kBlock;

void requireIsovalue(double isovalue) {
  if (!std::isfinite(isovalue))
    throw levelset::UsageError(
        fmt::format("the isovalue {} is not a finite number; give a number", isovalue));
}

}  // namespace

VolumeSurface::VolumeSurface(levelset::Volume volume, double isovalue, VolumeInside inside,
                             const levelset::Progress& progress)
    : volume_(std::make_shared<const levelset::Volume>(std::move(volume))),
      isovalue_(isovalue),
      inside_(inside) {
  requireIsovalue(isovalue);
  // Sums of products of values must fit single precision.
  constexpr double kLargest = 1e30;
  const double largest = std::max(std::abs(volume_->lowest()), std::abs(volume_->highest()));
  if (!(largest <= kLargest))
    throw levelset::InvalidInput(
        fmt::format("the volume has values up to {:.3g}, but at most {:.0e} can be drawn; divide "
                    "the values by a constant",
                    largest, kLargest));
  ranges_ = std::make_shared<const levelset::BlockRanges>(*volume_, progress);
}

VolumeSurface VolumeSurface::withIsovalue(double isovalue, VolumeInside inside) const {
  requireIsovalue(isovalue);
  VolumeSurface other = *this;
  other.isovalue_ = isovalue;
  other.inside_ = inside;
  return other;
}

double VolumeSurface::voxelSize() const {
  const V3d spacing = volume_->grid().spacing();
  return std::max({spacing.x, spacing.y, spacing.z});
}

bool VolumeSurface::isEmpty() const {
  const V3i blocks = ranges_->size();
  if (blocks.x == 0 || blocks.y == 0 || blocks.z == 0) return true;
  return inside_ == VolumeInside::Above
             ? !(volume_->highest() > isovalue_ && volume_->lowest() <= isovalue_)
             : !(volume_->lowest() < isovalue_ && volume_->highest() >= isovalue_);
}

bool VolumeSurface::isEmpty(Filter filter) const {
  return isEmpty() && (filter == Filter::Trilinear || blocks(filter).empty());
}

std::vector<V3i> VolumeSurface::blocks(Filter filter) const {
  if (filter == Filter::Trilinear)
    return ranges_->crossed(isovalue_, inside_ == VolumeInside::Below);
  // A coefficient f − ∇²f/6 is twice the value less the mean of its six neighbours. A coefficient
  // of the quadratic super spline has negative weights of at most 1/16 in sum. A Bézier coefficient
  // of the tricubic filter has weights along each axis that sum to 1, with magnitudes of 4/3 in
  // sum. So the magnitudes of its 64 weights sum to at most 64/27, and the negative ones to half of
  // 64/27 − 1. A coefficient of the spline on octahedra is a mean of linear functions at
  // vertices, whose negative weights sum to at most 1/8.
  const double widening = filter == Filter::BSplineQi        ? 1
                          : filter == Filter::Tricubic       ? 37.0 / 54
                          : filter == Filter::SuperQuadratic ? 1.0 / 16
                          : filter == Filter::BccQuadratic   ? 1.0 / 8
                                                             : 0;
  return ranges_->crossedWidely(isovalue_, widening);
}

void VolumeSurface::copyField(const V3i& low, const V3i& size, float* out) const {
  const V3i points = volume_->size();
  const levelset::VolumeScale scale = volume_->scale();
  const levelset::ExtendedGrid extended(
      [this](int i, int j, int k) { return volume_->at(i, j, k); }, {points.x, points.y, points.z},
      levelset::GridExtension::Quadratic);
  const auto isWithin = [](int n, int count, int reach) {
    return n >= -reach && n < count + reach;
  };
  // The part of a row along x that lies in the volume.
  const int from = std::clamp(low.x, 0, points.x), to = std::clamp(low.x + size.x, from, points.x);
  std::array<double, 32> buffer;
  std::vector<double> longer;
  std::span<double> row(buffer);
  if (to - from > static_cast<int>(buffer.size())) {
    longer.resize(static_cast<std::size_t>(to - from));
    row = longer;
  }
  row = row.first(static_cast<std::size_t>(to - from));
  const std::ptrdiff_t stepX = static_cast<std::ptrdiff_t>(size.y) * size.z;
  for (int y = 0; y < size.y; ++y)
    for (int z = 0; z < size.z; ++z) {
      float* column = out + static_cast<std::ptrdiff_t>(y) * size.z + z;
      const int j = low.y + y, k = low.z + z;
      const bool isRow = isWithin(j, points.y, 0) && isWithin(k, points.z, 0);
      if (isRow && !row.empty()) {
        volume_->storedRun(volume_->index(from, j, k), row);
        for (int i = from; i < to; ++i)
          column[(i - low.x) * stepX] = field(scale(row[static_cast<std::size_t>(i - from)]));
      }
      const bool isNear = isWithin(j, points.y, kReach) && isWithin(k, points.z, kReach);
      for (int x = 0; x < size.x; ++x) {
        const int i = low.x + x;
        if (isRow && i >= from && i < to) {
          x = to - low.x - 1;
          continue;
        }
        column[x * stepX] =
            isNear && isWithin(i, points.x, kReach) ? field(extended(i, j, k)) : 0.0f;
      }
    }
}

std::vector<double> VolumeSurface::extents(const std::vector<V3d>& directions) const {
  const std::vector<V3i> all = blocks(Filter::Trilinear);
  const std::vector<double> nothing(directions.size(), -std::numeric_limits<double>::infinity());
  // In index space, the product of a point with a direction is a linear function of the point.
  const Imath::M44d& m = indexToWorld();
  std::vector<V3d> along;
  std::vector<double> offset, reach;
  for (const V3d& d : directions) {
    const V3d a(V3d(m[0][0], m[0][1], m[0][2]).dot(d), V3d(m[1][0], m[1][1], m[1][2]).dot(d),
                V3d(m[2][0], m[2][1], m[2][2]).dot(d));
    along.push_back(a);
    offset.push_back(V3d(m[3][0], m[3][1], m[3][2]).dot(d));
    reach.push_back(0.5 * kVolumeBlock * (std::abs(a.x) + std::abs(a.y) + std::abs(a.z)));
  }
  const auto mayExtend = [&](const V3i& block, const std::vector<double>& extents) {
    const V3d centre = V3d(block) + V3d(0.5 * kVolumeBlock);
    for (std::size_t d = 0; d < directions.size(); ++d)
      if (centre.dot(along[d]) + offset[d] + 1.000001 * reach[d] >= extents[d]) return true;
    return false;
  };
  const V3i points = volume_->size();
  const auto addBlock = [&](const V3i& block, std::vector<double>& extents) {
    if (!mayExtend(block, extents)) return;
    V3i count;
    for (int a = 0; a < 3; ++a) count[a] = std::min(kVolumeBlock + 1, points[a] - block[a]);
    std::array<float, (kVolumeBlock + 1) * (kVolumeBlock + 1) * (kVolumeBlock + 1)> values;
    copyField(block, count, values.data());
    const int strides[3] = {count.y * count.z, count.z, 1};
    for (int x = 0; x < count.x; ++x)
      for (int y = 0; y < count.y; ++y)
        for (int z = 0; z < count.z; ++z) {
          const V3i local(x, y, z);
          const int at = x * strides[0] + y * strides[1] + z;
          const float a = values[static_cast<std::size_t>(at)];
          for (int axis = 0; axis < 3; ++axis) {
            if (local[axis] + 1 >= count[axis]) continue;
            const float b = values[static_cast<std::size_t>(at + strides[axis])];
            if ((a < 0) == (b < 0)) continue;
            V3d p(block + local);
            p[axis] += static_cast<double>(a) / (static_cast<double>(a) - static_cast<double>(b));
            for (std::size_t d = 0; d < directions.size(); ++d)
              extents[d] = std::max(extents[d], p.dot(along[d]) + offset[d]);
          }
        }
  };
  // With the extents of a few blocks known, most other blocks need no search.
  constexpr std::size_t kSample = 61;
  std::vector<double> sampled = nothing;
  for (std::size_t n = 0; n < all.size(); n += kSample) addBlock(all[n], sampled);
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, all.size(), 64), sampled,
      [&](const tbb::blocked_range<std::size_t>& range, std::vector<double> extents) {
        for (std::size_t n = range.begin(); n < range.end(); ++n) addBlock(all[n], extents);
        return extents;
      },
      [](std::vector<double> a, const std::vector<double>& b) {
        for (std::size_t d = 0; d < a.size(); ++d) a[d] = std::max(a[d], b[d]);
        return a;
      });
}

Imath::Box3d VolumeSurface::bounds() const {
  std::vector<V3d> axes;
  for (const double sign : {1.0, -1.0})
    for (int axis = 0; axis < 3; ++axis) {
      axes.emplace_back(0);
      axes.back()[axis] = sign;
    }
  const std::vector<double> e = extents(axes);
  if (!std::isfinite(e[0])) return {};
  return {V3d(-e[3], -e[4], -e[5]), V3d(e[0], e[1], e[2])};
}

}  // namespace render
