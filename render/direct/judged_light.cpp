#include "render/direct/judged_light.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace render {
namespace {

using Imath::V3d;

/// Distances at which a ray crosses a plane of grid points, in ascending order, with the ends of
/// the part of the ray in the grid. Empty when the ray misses the grid.
std::vector<double> planesAlong(const V3d& origin, const V3d& step, const Imath::V3i& points,
                                double near, double far) {
  double begin = near, end = far;
  for (int axis = 0; axis < 3; ++axis) {
    const double last = points[axis] - 1;
    if (step[axis] == 0) {
      if (origin[axis] < 0 || origin[axis] > last) return {};
      continue;
    }
    double low = (0 - origin[axis]) / step[axis], high = (last - origin[axis]) / step[axis];
    if (low > high) std::swap(low, high);
    begin = std::max(begin, low);
    end = std::min(end, high);
  }
  if (!(begin < end)) return {};
  std::vector<double> planes = {begin, end};
  for (int axis = 0; axis < 3; ++axis) {
    if (step[axis] == 0) continue;
    for (int plane = 0; plane < points[axis]; ++plane) {
      const double at = (plane - origin[axis]) / step[axis];
      if (at > begin && at < end) planes.push_back(at);
    }
  }
  std::sort(planes.begin(), planes.end());
  return planes;
}

/// Steps along a ray in one cell.
struct CellSteps {
  const DirectVolume& volume;
  V3d start, step;
  double brightness = 1;
  VolumeLight& light;

  [[nodiscard]] double valueAt(double t) const {
    return volume.volume().trilinear(start + step * t);
  }

  /// Adds the light between two distances. @param from, to  values there
  void add(double begin, double end, double from, double to, int depth) const {
    const auto& points = volume.transfer().points();
    const bool hasPoint =
        std::any_of(points.begin(), points.end(), [&](const TransferPoint& point) {
          return std::min(from, to) < point.value && point.value < std::max(from, to);
        });
    constexpr int kDeepest = 24;
    const double middle = 0.5 * (begin + end), value = valueAt(middle);
    if (hasPoint && depth < kDeepest) {
      add(begin, middle, from, value, depth + 1);
      add(middle, end, value, to, depth + 1);
      return;
    }
    const double extinction = volume.transfer().extinction(value);
    if (!(extinction > 0)) return;
    const double passed = std::exp(-extinction * (end - begin));
    light.colour += volume.transfer().emission(value) *
                    (brightness * light.transmittance * (1 - passed) / extinction);
    light.transmittance *= passed;
  }
};

}  // namespace

VolumeLight judgedLight(const DirectVolume& volume, const V3d& origin, const V3d& direction,
                        double near, double far, const VolumeShading* shading, int steps) {
  V3d start, step;
  volume.worldToIndex().multVecMatrix(origin, start);
  volume.worldToIndex().multDirMatrix(direction, step);
  VolumeLight light;
  const std::vector<double> planes = planesAlong(start, step, volume.volume().size(), near, far);
  for (std::size_t n = 1; n < planes.size(); ++n) {
    const double length = (planes[n] - planes[n - 1]) / steps;
    const double brightness =
        shading ? volume.brightness(start + step * (0.5 * (planes[n - 1] + planes[n])), *shading)
                : 1;
    const CellSteps cell{volume, start, step, brightness, light};
    double from = cell.valueAt(planes[n - 1]);
    for (int s = 0; s < steps && length > 0; ++s) {
      const double begin = planes[n - 1] + s * length, end = begin + length;
      const double to = cell.valueAt(end);
      cell.add(begin, end, from, to, 0);
      from = to;
    }
  }
  return light;
}

}  // namespace render
