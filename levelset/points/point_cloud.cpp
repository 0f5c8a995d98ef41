#include "levelset/points/point_cloud.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"

namespace levelset {
namespace {

void requireCount(std::size_t count, std::size_t points, const char* name) {
  if (count != 0 && count != points)
    throw InvalidInput(
        fmt::format("the point cloud has {} {} for {} points; give one for each point, or none",
                    count, name, points));
}

template <typename Vector>
bool isFiniteVector(const Vector& v) {
  for (int axis = 0; axis < static_cast<int>(Vector::dimensions()); ++axis)
    if (!std::isfinite(v[axis])) return false;
  return true;
}

template <typename T, typename IsValid>
void requireEach(const std::vector<T>& list, const char* what, const IsValid& isValid) {
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const T& value) { return !isValid(value); });
  if (found != list.end())
    throw InvalidInput(fmt::format("{} {} of the point cloud; remove the point or repair it", what,
                                   found - list.begin()));
}

}  // namespace

std::string describe(const PointCloud& cloud) {
  std::vector<const char*> names;
  if (!cloud.normals.empty()) names.push_back("normals");
  if (!cloud.colors.empty()) names.push_back("colours");
  if (!cloud.radii.empty()) names.push_back("radii");
  if (!cloud.weights.empty()) names.push_back("weights");
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 < names.size() ? ", " : " and ";
    text += names[i];
  }
  return text;
}

void requirePoints(const PointCloud& cloud) {
  const std::size_t n = cloud.size();
  requireCount(cloud.normals.size(), n, "normals");
  requireCount(cloud.colors.size(), n, "colours");
  requireCount(cloud.radii.size(), n, "radii");
  requireCount(cloud.weights.size(), n, "weights");
  const auto isFinite = [](const auto& v) { return isFiniteVector(v); };
  requireEach(cloud.positions, "a coordinate is not a number of magnitude up to 3.4e38 at point",
              [](const Imath::V3d& p) {
                return std::abs(p.x) <= kMostCoordinate && std::abs(p.y) <= kMostCoordinate &&
                       std::abs(p.z) <= kMostCoordinate;
              });
  requireEach(cloud.normals, "a normal is not finite at point", isFinite);
  requireEach(cloud.colors, "a colour is not finite at point", isFinite);
  requireEach(cloud.radii, "the radius is not a positive number at point",
              [](float r) { return std::isfinite(r) && r > 0; });
  requireEach(cloud.weights, "the weight is negative or not finite at point",
              [](float w) { return std::isfinite(w) && w >= 0; });
}

Imath::Box3d bounds(const PointCloud& cloud) {
  Imath::Box3d box;
  for (const Imath::V3d& position : cloud.positions) box.extendBy(position);
  return box;
}

}  // namespace levelset
