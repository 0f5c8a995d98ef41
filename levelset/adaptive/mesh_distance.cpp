#include "levelset/adaptive/mesh_distance.h"

#include <fmt/core.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "levelset/convert/solid_surface.h"
#include "levelset/error.h"
#include "levelset/geometry/disjoint_sets.h"
#include "levelset/geometry/mesh_sides.h"
#include "levelset/geometry/position_table.h"
#include "levelset/memory/memory_limit.h"
#include "levelset/mesh_sign/self_intersections.h"

namespace levelset {
namespace {

using convert::LocalMesh;
using Imath::V3d;

void flip(convert::Triangle& triangle) {
  std::swap(triangle[1], triangle[2]);
}

V3d areaVector(const LocalMesh& mesh, std::size_t t) {
  return (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)) / 2;
}

V3d centroid(const LocalMesh& mesh, std::size_t t) {
  return (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
}

TriangleSearch searchOf(const LocalMesh& mesh) {
  std::vector<TriangleItem> items;
  items.reserve(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    items.push_back({{mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)}, t});
  return TriangleSearch(std::move(items));
}

/// The largest triangle of each patch, at the number of the patch.
std::vector<std::uint32_t> largestOf(const LocalMesh& mesh, DisjointSets& patches) {
  std::vector<std::uint32_t> largest(mesh.triangles.size());
  std::vector<double> area(mesh.triangles.size(), -1);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t patch = patches.find(t);
    const double own = areaVector(mesh, t).length();
    if (own <= area[patch]) continue;
    area[patch] = own;
    largest[patch] = t;
  }
  return largest;
}

/// Step from the centroid of a triangle to a point just in front of it.
V3d stepInFront(const LocalMesh& mesh, std::size_t t) {
  constexpr double kStep = 1e-4;
  const V3d normal = areaVector(mesh, t);
  const double area = normal.length();
  return area > 0 ? normal * (kStep / std::sqrt(area)) : V3d(0);
}

/// Merges the vertices at equal positions of the triangles from a number on.
void weld(LocalMesh& mesh, std::size_t first) {
  convert::PositionTable table(mesh.points, 3 * (mesh.triangles.size() - first));
  for (std::size_t t = first; t < mesh.triangles.size(); ++t)
    for (std::uint32_t& v : mesh.triangles[t]) v = table.findOrInsert(mesh.points[v], v);
}

}  // namespace

MeshDistance::MeshDistance(const TriMesh& mesh, double voxel, const MeshToBandOptions& options)
    : voxel_(voxel) {
  const Progress progress = monotonicProgress(options.progress);
  convert::SolidSurface surface =
      convert::solidSurface(mesh, voxel, options, subProgress(progress, 0, 0.6));
  certificate_ = surface.certificate;
  origin_ = V3d(surface.origin);
  const std::size_t given = surface.mesh.triangles.size();
  const bool isOpen = surface.field.isOpen();
  LocalMesh before;
  if (isOpen) {
    before = surface.mesh;
    convert::addOpenSurface(surface, options.halfWidth, memoryLimit(options.maxMemory),
                            subProgress(progress, 0.6, 0.7));
  }
  mesh_ = std::move(surface.mesh);
  requireOrientation();
  if (certificate_.method == SignMode::Closed && options.nesting == Nesting::Parity)
    orientComponents();
  else if (surface.field.isFlipped())
    flip_ = -1;
  report(progress, 0.75);
  if (isOpen) {
    const convert::WindingField field(before);
    weld(mesh_, given);
    orientSpan(given, field);
    measureAmbiguity(field);
  }
  report(progress, 0.8);
  search_ = searchOf(mesh_);
  normals_.emplace(mesh_);
  winding_ = convert::WindingField(mesh_);
  report(progress, 0.9);
  if (certificate_.method == SignMode::Winding) findSeparating();
  report(progress, 1);
}

/// Refuses a closed mesh in which triangles that share an edge run along it in the same direction.
void MeshDistance::requireOrientation() const {
  if (certificate_.method != SignMode::Closed) return;
  const std::vector<MeshSide> sides = sortedSides(mesh_.triangles);
  std::size_t wrong = 0;
  forEachEdge(sides, [&](auto first, auto end) {
    const auto rising = std::count_if(first, end, [](const MeshSide& s) { return s.rises; });
    wrong += 2 * rising != end - first;
  });
  if (wrong > 0)
    throw InvalidInput(
        fmt::format("at {} edges neighbouring triangles have opposite orientations; orient them "
                    "alike, or convert the mesh to a narrow band",
                    wrong));
}

/// Makes each component face away from the solid: outwards in an even depth of nesting, else
/// inwards. The winding number is then 1 inside and 0 outside.
void MeshDistance::orientComponents() {
  DisjointSets parts = connectedPatches(mesh_.triangles, [](std::uint32_t) { return true; });
  std::vector<double> volume(mesh_.triangles.size(), 0);
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
    const std::uint32_t part = parts.find(t);
    // Relative to a corner of the part, so that distant parts keep their digits.
    volume[part] += areaVector(mesh_, t).dot(mesh_.corner(t, 0) - mesh_.corner(part, 0));
  }
  bool isOne = true;
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
    isOne = isOne && parts.find(t) == 0;
    if (volume[parts.find(t)] < 0) flip(mesh_.triangles[t]);
  }
  if (isOne) return;
  // All components face outwards now: the winding number in front of a component counts those
  // around it.
  const std::vector<std::uint32_t> largest = largestOf(mesh_, parts);
  std::vector<bool> isInner(mesh_.triangles.size());
  {
    const convert::WindingField field(mesh_);
    for (std::uint32_t part = 0; part < mesh_.triangles.size(); ++part) {
      if (parts.find(part) != part) continue;
      constexpr double kTolerance = 0.02;
      const std::uint32_t t = largest[part];
      const double depth = field.within(kTolerance, centroid(mesh_, t) + stepInFront(mesh_, t));
      isInner[part] = std::lround(depth) % 2 != 0;
    }
  }
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
    if (isInner[parts.find(t)]) flip(mesh_.triangles[t]);
}

/// Orients the triangles that span holes: the winding number of the given ones is smaller in front.
void MeshDistance::orientSpan(std::size_t first, const convert::WindingField& given) {
  constexpr double kStep = 0.25, kTolerance = 0.01;
  tbb::parallel_for(first, mesh_.triangles.size(), [&](std::size_t t) {
    const V3d normal = areaVector(mesh_, t);
    if (normal.length2() == 0) return;
    const V3d centre = centroid(mesh_, t), step = normal.normalized() * kStep;
    const double rise =
        given.within(kTolerance, centre + step) - given.within(kTolerance, centre - step);
    if (rise > 0) flip(mesh_.triangles[t]);
  });
}

/// Finds the triangles whose normals tell inside from outside. Inner sheets have the inside on both
/// sides. Triangles that cross others are divided by them and do not count. The others form patches
/// with the same winding numbers beside each of their triangles, but for those near holes.
void MeshDistance::findSeparating() {
  const std::size_t count = mesh_.triangles.size();
  separates_.assign(count, true);
  for (const auto& [a, b] : convert::findSelfIntersections(mesh_.triangles, mesh_.points, {}))
    separates_[a] = separates_[b] = false;
  DisjointSets patches =
      connectedPatches(mesh_.triangles, [this](std::uint32_t t) { return separates_[t]; });
  // The largest triangle of a patch decides.
  const std::vector<std::uint32_t> largest = largestOf(mesh_, patches);
  std::vector<bool> isOuter(count);
  for (std::uint32_t patch = 0; patch < count; ++patch) {
    if (patches.find(patch) != patch || !separates_[patch]) continue;
    const V3d centre = centroid(mesh_, largest[patch]),
              step = flip_ * stepInFront(mesh_, largest[patch]);
    constexpr double kTolerance = 0.02, kOutside = 0.3, kInside = 0.7;
    isOuter[patch] = flip_ * winding_.within(kTolerance, centre + step) < kOutside &&
                     flip_ * winding_.within(kTolerance, centre - step) > kInside;
  }
  for (std::uint32_t t = 0; t < count; ++t)
    separates_[t] = separates_[t] && isOuter[patches.find(t)];
}

/// Measures the share of the area beside which points are neither clearly inside nor clearly
/// outside of the given triangles.
void MeshDistance::measureAmbiguity(const convert::WindingField& given) {
  constexpr std::size_t kMost = 8000;
  constexpr double kStep = 0.5, kTolerance = 0.02, kDoubt = 0.25;
  const std::size_t stride = mesh_.triangles.size() / kMost + 1;
  double area = 0, ambiguous = 0;
  for (std::size_t t = 0; t < mesh_.triangles.size(); t += stride) {
    const V3d normal = areaVector(mesh_, t);
    const double own = normal.length();
    if (own == 0) continue;
    const V3d centre = centroid(mesh_, t), step = normal * (kStep / own);
    area += own;
    for (const V3d& p : {centre + step, centre - step})
      if (std::abs(flip_ * given.within(kTolerance, p) - 0.5) < kDoubt) ambiguous += own / 2;
  }
  certificate_.ambiguousShare = area > 0 ? ambiguous / area : 1;
}

void MeshDistance::visitSurface(const Imath::Box3d& box, const Visit& visit) const {
  const Imath::Box3d local(box.min / voxel_ - origin_, box.max / voxel_ - origin_);
  const V3d centre = (local.min + local.max) * 0.5;
  const double reach = (local.max - centre).length2();
  bool goesOn = true;
  const auto pass = [&](const V3d& p) { goesOn = goesOn && visit((p + origin_) * voxel_, 0); };
  search_.visit(centre, reach, [&](const TriangleItem& item) {
    for (std::size_t k = 0; k < 3 && goesOn; ++k) {
      const V3d &a = item.corners[k], &b = item.corners[(k + 1) % 3];
      // The part of the edge in the box.
      double from = 0, to = 1;
      for (int axis = 0; axis < 3; ++axis) {
        const double along = b[axis] - a[axis];
        double enters = (local.min[axis] - a[axis]) / along,
               leaves = (local.max[axis] - a[axis]) / along;
        if (along < 0) std::swap(enters, leaves);
        if (along == 0) {
          const bool isBetween = a[axis] >= local.min[axis] && a[axis] <= local.max[axis];
          enters = isBetween ? 0 : 1;
          leaves = isBetween ? 1 : 0;
        }
        from = std::max(from, enters);
        to = std::min(to, leaves);
      }
      if (from > to) continue;
      pass(a + (b - a) * from);
      pass(a + (b - a) * (0.5 * (from + to)));
      pass(a + (b - a) * to);
    }
  });
}

bool MeshDistance::isInside(const V3d& local, std::uint32_t triangle) const {
  const auto foot = closestOnTriangle(local, mesh_.corner(triangle, 0), mesh_.corner(triangle, 1),
                                      mesh_.corner(triangle, 2));
  // Pseudonormals take a hundredth of the time of a winding number.
  if (separates_.empty() || separates_[triangle]) {
    const auto direction = normals_->at(triangle, foot.part);
    const double side = flip_ * direction.normal.dot(local - foot.point);
    if (!direction.onBorder && side != 0) return side < 0;
  }
  constexpr double kTolerance = 0.01;
  return flip_ * winding_.within(kTolerance, local) > 0.5;
}

V3d MeshDistance::gradient(const V3d& position, double value, double /*step*/) const {
  const V3d local = position / voxel_ - origin_;
  constexpr double kRounding = 1e-6, kOnSurface = 1e-5;  // voxels
  const double limit = (1 + kRounding) * std::abs(value) / voxel_ + kOnSurface;
  FoundItem found = search_.closest(local, limit * limit);
  if (!found.isValid()) found = search_.closest(local, std::numeric_limits<double>::infinity());
  const std::uint32_t triangle = found.index;
  const auto foot = closestOnTriangle(local, mesh_.corner(triangle, 0), mesh_.corner(triangle, 1),
                                      mesh_.corner(triangle, 2));
  const V3d away = local - foot.point;
  if (away.length() > kOnSurface) return away.normalized() * std::copysign(1.0, value);
  return flip_ * normals_->at(triangle, foot.part).normal.normalized();
}

double MeshDistance::at(const V3d& position, const Known& known) const {
  const V3d local = position / voxel_ - origin_;
  constexpr double kRounding = 1e-6;
  double limit = std::numeric_limits<double>::infinity();
  if (known.apart >= 0) {
    limit = (1 + kRounding) * (std::abs(known.value) + known.apart) / voxel_;
    limit *= limit;
  }
  FoundItem found = search_.closest(local, limit);
  if (!found.isValid()) found = search_.closest(local, std::numeric_limits<double>::infinity());
  const double distance = std::sqrt(found.squared) * voxel_;
  // The surface does not come between two points that are nearer to each other than to it.
  const bool isSame = known.apart >= 0 && (1 - kRounding) * std::abs(known.value) > known.apart;
  const bool inside = isSame ? known.value < 0 : isInside(local, found.index);
  return inside ? -distance : distance;
}

}  // namespace levelset
