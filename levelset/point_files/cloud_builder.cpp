#include "levelset/point_files/cloud_builder.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/error.h"

namespace levelset::point_files {
namespace {

constexpr std::size_t kMostPoints = std::numeric_limits<std::uint32_t>::max();

template <typename T>
double bytesOf(const std::vector<T>& list) {
  return static_cast<double>(list.capacity()) * sizeof(T);
}

}  // namespace

void CloudBuilder::requireMore(double bytes) const {
  requireMemory(static_cast<double>(input_.size()) + bytesOf(cloud_.positions) +
                    bytesOf(cloud_.normals) + bytesOf(cloud_.colors) + bytesOf(cloud_.radii) +
                    bytesOf(cloud_.weights) + bytes,
                options_.maxMemory);
}

void CloudBuilder::reserve(std::size_t points, const PointCloud& attributes) {
  if (points > kMostPoints)
    failFile(name_,
             fmt::format("holds {} points, more than the maximum of 4294967295; split it", points));
  const std::size_t each = sizeof(Imath::V3d) + attributes.normals.size() * sizeof(Imath::V3f) +
                           attributes.colors.size() * sizeof(Imath::V4f) +
                           (attributes.radii.size() + attributes.weights.size()) * sizeof(float);
  requireMore(static_cast<double>(points) * static_cast<double>(each));
  cloud_.positions.reserve(points);
  if (!attributes.normals.empty()) cloud_.normals.reserve(points);
  if (!attributes.colors.empty()) cloud_.colors.reserve(points);
  if (!attributes.radii.empty()) cloud_.radii.reserve(points);
  if (!attributes.weights.empty()) cloud_.weights.reserve(points);
}

void CloudBuilder::declarePrecision(CoordinatePrecision precision) {
  cloud_.precision = precision;
  precisionDeclared_ = true;
}

void CloudBuilder::note(const std::string& text) {
  if (!options_.notes) return;
  if (std::find(options_.notes->begin(), options_.notes->end(), text) == options_.notes->end())
    options_.notes->push_back(text);
}

void CloudBuilder::addPosition(const Imath::V3d& position, FilePosition place, const char* at) {
  for (int axis = 0; axis < 3; ++axis) {
    const double c = position[axis];
    if (std::abs(c) <= kMostCoordinate) {
      allFloat_ = allFloat_ && static_cast<double>(static_cast<float>(c)) == c;
      continue;
    }
    const bool isFinite = std::isfinite(c);
    failAt(name_, place,
           fmt::format("the coordinate {} is {}; {}", c,
                       isFinite ? "beyond the range of float, 3.4e38" : "not a finite number",
                       isFinite ? "scale the points down" : "remove the point or export it again"));
  }
  cloud_.positions.push_back(position);
  constexpr std::size_t kTickMask = 0xFFFF;
  if ((cloud_.positions.size() & kTickMask) != 0) return;
  report(options_.progress,
         static_cast<double>(at - input_.data()) / static_cast<double>(input_.size()));
  requireMore(0);
  if (cloud_.positions.size() > kMostPoints)
    failFile(name_, "holds more than 4294967295 points; split it");
}

void CloudBuilder::addNormal(const Imath::V3d& normal, FilePosition place) {
  for (int axis = 0; axis < 3; ++axis)
    if (!(std::abs(normal[axis]) <= kMostCoordinate))
      failAt(name_, place,
             fmt::format("a normal holds {}, which is not a finite number of type float; remove "
                         "the point, or read it without attributes (--no-attributes)",
                         normal[axis]));
  cloud_.normals.emplace_back(normal);
}

void CloudBuilder::addColor(const Imath::V4f& color, FilePosition place) {
  for (int i = 0; i < 4; ++i)
    if (!std::isfinite(color[i]))
      failAt(name_, place,
             fmt::format("a colour holds {}, which is not a finite number of type float; remove "
                         "the point, or read it without attributes (--no-attributes)",
                         color[i]));
  cloud_.colors.push_back(color);
}

void CloudBuilder::addRadius(double radius, FilePosition place) {
  const auto stored = static_cast<float>(radius);
  if (!(stored > 0) || !std::isfinite(stored))
    failAt(name_, place,
           fmt::format("the radius is {}, which is not a positive number of type float; remove the "
                       "point, or read it without attributes (--no-attributes)",
                       radius));
  cloud_.radii.push_back(stored);
}

void CloudBuilder::addWeight(double weight, FilePosition place) {
  const auto stored = static_cast<float>(weight);
  if (!(stored >= 0) || !std::isfinite(stored))
    failAt(name_, place,
           fmt::format("the weight is {}, which is negative or not a number of type float; remove "
                       "the point, or read it without attributes (--no-attributes)",
                       weight));
  cloud_.weights.push_back(stored);
}

PointCloud CloudBuilder::finish() {
  if (cloud_.isEmpty()) failFile(name_, "holds no points; export it again");
  if (!precisionDeclared_)
    cloud_.precision = allFloat_ ? CoordinatePrecision::Float : CoordinatePrecision::Double;
  return std::move(cloud_);
}

bool hasByteColors(const PointCloud& cloud) {
  return std::all_of(cloud.colors.begin(), cloud.colors.end(), [](const Imath::V4f& color) {
    for (int i = 0; i < 4; ++i)
      if (!(color[i] >= 0 && color[i] <= 1) || std::round(color[i] * 255) / 255 != color[i])
        return false;
    return true;
  });
}

bool hasAlpha(const PointCloud& cloud) {
  return std::any_of(cloud.colors.begin(), cloud.colors.end(),
                     [](const Imath::V4f& color) { return color[3] != 1; });
}

void requireColorPart(const std::string& name, FilePosition place, double part) {
  if (!(part >= 0 && part <= 255))
    failAt(name, place,
           fmt::format("a colour holds {}, which is not between 0 and 255; repair the line, or "
                       "read the file without attributes (--no-attributes)",
                       part));
}

unsigned char colorByte(float part) {
  return static_cast<unsigned char>(std::lround(std::clamp(part, 0.0f, 1.0f) * 255));
}

}  // namespace levelset::point_files
