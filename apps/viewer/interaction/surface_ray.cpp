#include "apps/viewer/interaction/surface_ray.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "levelset/grids/sample.h"

namespace viewer {
namespace {

using Imath::V3d;

/// Part of a ray within a box; the first is above the second outside the box.
std::pair<double, double> partInBox(const Imath::Box3d& box, const render::Camera::Ray& ray) {
  double low = ray.near, high = ray.far;
  for (int axis = 0; axis < 3; ++axis) {
    const double from = box.min[axis] - ray.origin[axis], to = box.max[axis] - ray.origin[axis],
                 slope = ray.direction[axis];
    if (slope == 0) {
      if (from > 0 || to < 0) return {1, 0};
      continue;
    }
    low = std::max(low, std::min(from / slope, to / slope));
    high = std::min(high, std::max(from / slope, to / slope));
  }
  return {low, high};
}

}  // namespace

std::optional<SurfaceHit> surfaceUnder(const levelset::NarrowBand& band, const Imath::Box3d& bounds,
                                       const render::Camera::Ray& ray) {
  const double voxel = band.voxelSize();
  const Imath::Box3d box(bounds.min - V3d(voxel), bounds.max + V3d(voxel));
  const levelset::BandSampler sampler(band);
  const auto at = [&](double t) { return ray.origin + ray.direction * t; };
  // The interpolant may be steeper than the distance, so steps are a little shorter than φ.
  constexpr double kShare = 0.9, kLeastStep = 0.1;
  auto [t, end] = partInBox(box, ray);
  double outside = t;
  bool wasOutside = false;
  while (t <= end) {
    const double phi = sampler.value(at(t));
    if (phi <= 0 && wasOutside) {
      double inside = t;
      for (;;) {
        const double middle = 0.5 * (outside + inside);
        if (middle <= outside || middle >= inside) break;
        (sampler.value(at(middle)) > 0 ? outside : inside) = middle;
      }
      return SurfaceHit{at(inside), sampler.normal(at(inside))};
    }
    wasOutside = phi > 0;
    outside = t;
    t += std::max(kShare * std::abs(phi), kLeastStep * voxel);
  }
  return std::nullopt;
}

}  // namespace viewer
