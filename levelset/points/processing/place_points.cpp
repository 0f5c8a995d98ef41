#include "levelset/points/processing/place_points.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <array>
#include <atomic>
#include <cmath>
#include <vector>

#include "levelset/error.h"
#include "levelset/points/processing/point_spacing.h"

namespace levelset {
namespace {

using Imath::V3d;

bool isAffineMap(const Imath::M44d& m) {
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 4; ++k)
      if (!std::isfinite(m[i][k])) return false;
  return m[0][3] == 0 && m[1][3] == 0 && m[2][3] == 0 && m[3][3] == 1;
}

template <typename Keeps>
PointCloud keepPoints(const PointCloud& cloud, const Keeps& keeps) {
  requirePoints(cloud);
  std::vector<std::uint32_t> kept;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (keeps(cloud.positions[i])) kept.push_back(static_cast<std::uint32_t>(i));
  if (kept.empty())
    throw InvalidInput(
        fmt::format("none of the {} points remains; move the box or the plane", cloud.size()));
  return selectPoints(cloud, kept);
}

}  // namespace

PointCloud transform(PointCloud cloud, const Imath::M44d& matrix) {
  requirePoints(cloud);
  const double determinant = Imath::M44d(matrix).determinant();
  if (!isAffineMap(matrix) || !(std::abs(determinant) > 0) || !std::isfinite(determinant))
    throw UsageError("the matrix is not affine and invertible; give an invertible matrix");
  const std::array<V3d, 3> slopes = {V3d(matrix[0][0], matrix[0][1], matrix[0][2]),
                                     V3d(matrix[1][0], matrix[1][1], matrix[1][2]),
                                     V3d(matrix[2][0], matrix[2][1], matrix[2][2])};
  const bool turns = slopes != std::array{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
  const double scale = std::cbrt(std::abs(determinant));
  cloud.precision = CoordinatePrecision::Double;  // transformed coordinates may need more digits
  std::atomic<bool> isFar = false, hasRadii = true;
  tbb::parallel_for(std::size_t{0}, cloud.size(), [&](std::size_t i) {
    V3d moved;
    matrix.multVecMatrix(cloud.positions[i], moved);
    for (int axis = 0; axis < 3; ++axis)
      if (!(std::abs(moved[axis]) <= kMostCoordinate)) isFar = true;
    cloud.positions[i] = moved;
    if (turns && !cloud.normals.empty())
      cloud.normals[i] =
          Imath::V3f(transformedNormal(V3d(cloud.normals[i]), slopes, determinant < 0 ? -1 : 1));
    if (cloud.radii.empty()) return;
    const float radius = static_cast<float>(scale * static_cast<double>(cloud.radii[i]));
    if (!(radius > 0) || !std::isfinite(radius)) hasRadii = false;
    cloud.radii[i] = radius;
  });
  if (isFar)
    throw InvalidInput(
        "a coordinate exceeds 3.4e38, the greatest number of type float; choose a smaller scale");
  if (!hasRadii)
    throw InvalidInput(
        "a radius leaves the range of float, 1.4e-45 to 3.4e38; choose another scale");
  return cloud;
}

PointCloud clip(const PointCloud& cloud, const Imath::Box3d& box) {
  if (box.isEmpty()) throw UsageError("the box is empty; give its low corner first");
  return keepPoints(cloud, [&](const V3d& p) { return box.intersects(p); });
}

PointCloud clip(const PointCloud& cloud, const Imath::Plane3d& plane) {
  const double length = plane.normal.length();
  if (!std::isfinite(plane.distance) || !std::isfinite(length) || !(length > 0))
    throw UsageError("the plane has no finite normal; give a normal of positive length");
  return keepPoints(cloud, [&](const V3d& p) { return plane.distanceTo(p) <= 0; });
}

}  // namespace levelset
