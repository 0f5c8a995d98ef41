#include "apps/viewer/volume/volume_slices.h"

#include <Imath/ImathMatrix.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace viewer {
namespace {

using Imath::V3d;

/// Finds points of slices, with the transforms that all rays need.
class SliceFinder {
 public:
  SliceFinder(const levelset::Volume& volume, const SliceView& slices, const render::Camera& camera)
      : volume_(volume),
        slices_(slices),
        camera_(camera),
        worldToIndex_(volume.grid().indexToWorld.inverse()),
        viewAxis_(camera.axis()) {}

  [[nodiscard]] std::optional<SlicePoint> at(double x, double y) const {
    const render::Camera::Ray ray = camera_.ray(x, y);
    V3d origin, direction;
    worldToIndex_.multVecMatrix(ray.origin, origin);
    worldToIndex_.multDirMatrix(ray.direction, direction);
    const double perLength = ray.direction.dot(viewAxis_);
    std::optional<SlicePoint> first;
    V3d index;
    for (int axis = 0; axis < 3; ++axis) {
      const std::optional<double>& place = slices_.at[static_cast<std::size_t>(axis)];
      if (!place || direction[axis] == 0) continue;
      const double along = (*place - origin[axis]) / direction[axis], depth = along * perLength;
      if (!(along > 0 && along >= ray.near && along <= ray.far) || (first && depth >= first->depth))
        continue;
      V3d hit = origin + direction * along;
      hit[axis] = *place;
      if (!isInGrid(hit)) continue;
      index = hit;
      first = {static_cast<std::size_t>(axis), ray.origin + ray.direction * along, depth, 0};
    }
    if (first) first->value = volume_.trilinear(index);
    return first;
  }

 private:
  [[nodiscard]] bool isInGrid(const V3d& index) const {
    const V3d last = V3d(volume_.size() - Imath::V3i(1));
    for (int axis = 0; axis < 3; ++axis)
      if (!(index[axis] >= 0 && index[axis] <= last[axis])) return false;
    return true;
  }

  const levelset::Volume& volume_;
  const SliceView& slices_;
  const render::Camera& camera_;
  Imath::M44d worldToIndex_;
  V3d viewAxis_;
};

std::uint8_t greyOf(double value, const SliceView& slices) {
  if (!(slices.white > slices.black)) return value < slices.white ? 0 : 255;
  const double share = (value - slices.black) / (slices.white - slices.black);
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)));
}

}  // namespace

std::optional<SlicePoint> sliceAt(const levelset::Volume& volume, const SliceView& slices,
                                  const render::Camera& camera, double x, double y) {
  return SliceFinder(volume, slices, camera).at(x, y);
}

V3d sliceNormal(const levelset::Volume& volume, std::size_t axis) {
  // Normals are transformed by the inverse transpose.
  const Imath::M44d inverse = volume.grid().indexToWorld.inverse();
  const int column = static_cast<int>(axis);
  return V3d(inverse[0][column], inverse[1][column], inverse[2][column]).normalized();
}

void paintSlices(const levelset::Volume& volume, const SliceView& slices,
                 const render::Camera& camera, const render::Image& picture,
                 std::vector<std::uint8_t>& colours) {
  const SliceFinder finder(volume, slices, camera);
  const std::vector<float>& depths = picture.channels.at("Z");
  const auto place = [](int at, int size, int of) {
    return std::min(static_cast<int>((at + 0.5) * of / size), of - 1);
  };
  const auto paintRow = [&](int y) {
    const auto row = static_cast<std::size_t>(place(y, camera.height, picture.height)) *
                     static_cast<std::size_t>(picture.width);
    for (int x = 0; x < camera.width; ++x) {
      const std::optional<SlicePoint> seen = finder.at(x + 0.5, y + 0.5);
      if (!seen) continue;
      const auto surface = static_cast<double>(
          depths[row + static_cast<std::size_t>(place(x, camera.width, picture.width))]);
      std::uint8_t* p = colours.data() +
                        4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                             static_cast<std::size_t>(x));
      // Where the ray through the middle of a pixel meets no surface, the pixel may show an edge.
      const double before =
          std::isfinite(surface) && seen->depth < surface ? 0 : static_cast<double>(p[3]) / 255;
      const double grey = greyOf(seen->value, slices);
      for (int c = 0; c < 3; ++c)
        p[c] = static_cast<std::uint8_t>(std::lround(before * p[c] + (1 - before) * grey));
      p[3] = 255;
    }
  };
  tbb::parallel_for(tbb::blocked_range<int>(0, camera.height, 8), [&](const auto& rows) {
    for (int y = rows.begin(); y < rows.end(); ++y) paintRow(y);
  });
}

}  // namespace viewer
