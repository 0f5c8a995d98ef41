#include "render/segmented/interface_caster.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/segmented/interface_kernel.h"
#include "render/segmented/interface_tables.h"
#include "render/segmented/sheet_surface.h"

namespace render {

using Imath::V3d;
using levelset::RegionLabel;

namespace {

// A ray behind a sheet does not meet it again, in spite of rounding: it sees no sheet within this
// distance, voxels.
constexpr double kBehindSheet = 1e-7;

V3d unitNormal(const V3d& v, const V3d& otherwise) {
  const double length = v.length();
  return length > 0 && std::isfinite(length) ? v / length : otherwise;
}

}  // namespace

InterfaceCaster::InterfaceCaster(const levelset::SegmentedField& field,
                                 const std::vector<RegionLabel>& hidden, std::size_t maxBytes)
    : field_(field),
      tables_(
          std::make_shared<const InterfaceTables>(makeInterfaceTables(field, hidden, maxBytes))) {
  const std::vector<double> e = extents(
      {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1), V3d(-1, 0, 0), V3d(0, -1, 0), V3d(0, 0, -1)});
  if (std::isfinite(e[0])) bounds_ = {V3d(-e[3], -e[4], -e[5]), V3d(e[0], e[1], e[2])};
}

bool InterfaceCaster::isShown(RegionLabel label) const {
  return tables_->isShown(label);
}

std::vector<double> InterfaceCaster::extents(const std::vector<V3d>& directions) const {
  return interfaceExtents(*tables_, directions);
}

std::size_t InterfaceCaster::bytes() const {
  return tables_->bytes();
}

std::size_t InterfaceCaster::mixedCellCount() const {
  return tables_->mixedCells;
}

std::size_t InterfaceCaster::sheetTriangleCount() const {
  return tables_->sheets ? tables_->sheets->meshTriangles : 0;
}

InterfaceStart InterfaceCaster::start(const InterfaceRay& ray) const {
  InterfaceStart start;
  tables_->worldToIndex.multVecMatrix(ray.origin, start.from);
  tables_->worldToIndex.multDirMatrix(ray.direction, start.step);
  start.t = ray.near;
  start.end = ray.far;
  start.begin = ray.label ? ray.near + kBehindSheet * field_.voxelSize() : ray.near;
  // The kernel reads one grid point before a cell and two behind it.
  for (int axis = 0; axis < 3; ++axis) {
    const double low = 1, high = tables_->points[axis] - 2, from = start.from[axis],
                 step = start.step[axis];
    if (step == 0) {
      if (!(from >= low && from <= high)) return start;
      continue;
    }
    const double a = (low - from) * (1 / step), b = (high - from) * (1 / step);
    start.t = std::max(start.t, std::min(a, b));
    start.end = std::min(start.end, std::max(a, b));
  }
  if (!(start.t < start.end)) return start;
  for (int axis = 0; axis < 3; ++axis)
    start.cell[axis] =
        std::clamp(static_cast<int>(std::floor(start.from[axis] + start.step[axis] * start.t)), 1,
                   tables_->points[axis] - 3);
  if (ray.label && start.t == ray.near) start.label = *ray.label;
  start.isInside = true;
  return start;
}

InterfaceHit InterfaceCaster::hitOf(const InterfaceRay& ray, double distance, int front, int behind,
                                    const V3d& facet, const V3d& smooth) const {
  InterfaceHit hit;
  hit.found = true;
  hit.distance = distance;
  hit.front = static_cast<RegionLabel>(front);
  hit.behind = static_cast<RegionLabel>(behind);
  // Gradients are transformed by the inverse transpose of the map from index to world space.
  const Imath::M44d& m = tables_->worldToIndex;
  const auto toWorld = [&](const V3d& g) {
    return V3d(m[0][0] * g.x + m[0][1] * g.y + m[0][2] * g.z,
               m[1][0] * g.x + m[1][1] * g.y + m[1][2] * g.z,
               m[2][0] * g.x + m[2][1] * g.y + m[2][2] * g.z);
  };
  hit.facetNormal = unitNormal(toWorld(facet), -ray.direction);
  hit.normal = unitNormal(toWorld(smooth), hit.facetNormal);
  return hit;
}

InterfaceHit InterfaceCaster::firstHit(const InterfaceRay& ray) const {
  const InterfaceStart first = start(ray);
  if (!first.isInside) return {};
  InterfaceKernel kernel(*tables_, true);
  InterfaceKernel::CrossingRay found = InterfaceKernel::rayOf(first);
  kernel.followInterfaces(found, std::numeric_limits<int>::max());
  if (found.state != InterfaceKernel::kCrossed) return {};
  return hitOf(ray, found.t, found.front, found.behind,
               V3d(found.facetX, found.facetY, found.facetZ),
               V3d(found.smoothX, found.smoothY, found.smoothZ));
}

bool InterfaceCaster::isOccluded(const InterfaceRay& ray) const {
  const InterfaceStart first = start(ray);
  if (!first.isInside) return false;
  InterfaceKernel kernel(*tables_, false);
  InterfaceKernel::CrossingRay found = InterfaceKernel::rayOf(first);
  kernel.followInterfaces(found, std::numeric_limits<int>::max());
  return found.state == InterfaceKernel::kCrossed;
}

InterfaceRay InterfaceCaster::behind(const InterfaceRay& ray, const InterfaceHit& hit) {
  return {ray.origin, ray.direction, hit.distance, ray.far, hit.behind};
}

}  // namespace render
