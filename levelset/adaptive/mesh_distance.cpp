#include "levelset/adaptive/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "levelset/convert/mesh_to_band_input.h"
#include "levelset/convert/solid_surface.h"
#include "levelset/error.h"
#include "levelset/geometry/disjoint_sets.h"
#include "levelset/geometry/surface_components.h"
#include "levelset/memory_limit.h"
#include "levelset/mesh_sign/self_intersections.h"

namespace levelset {
namespace {

using convert::LocalMesh;
using Imath::V3d;

void flip(convert::Triangle& triangle) {
  std::swap(triangle[1], triangle[2]);
}

TriangleSearch searchOf(const LocalMesh& mesh) {
  std::vector<TriangleItem> items;
  items.reserve(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    items.push_back({{mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)}, t});
  return TriangleSearch(std::move(items));
}

}  // namespace

MeshDistance::MeshDistance(const TriMesh& mesh, double voxel, const MeshToBandOptions& options)
    : voxel_(voxel) {
  convert::checkMeshInput(mesh, voxel, options);
  convert::SolidSurface surface =
      convert::solidSurface(mesh, voxel, options, subProgress(options.progress, 0, 0.8));
  certificate_ = surface.certificate;
  origin_ = V3d(surface.origin);
  const std::size_t given = surface.mesh.triangles.size();
  const bool isOpen = surface.field.isOpen();
  if (isOpen)
    convert::addOpenSurface(surface, options.halfWidth, memoryLimit(options.maxMemory),
                            subProgress(options.progress, 0.8, 1));
  mesh_ = std::move(surface.mesh);
  if (certificate_.method == SignMode::Closed && options.nesting == Nesting::Parity)
    orientComponents();
  else if (surface.field.isFlipped())
    flip_ = -1;
  if (isOpen) orientSpan(given);
  search_ = searchOf(mesh_);
  normals_.emplace(mesh_);
  winding_ = convert::WindingField(mesh_);
  if (certificate_.method == SignMode::Winding) {
    findSeparating();
    measureAmbiguity(given);
  }
}

/// Makes each component face away from the solid: outwards in an even depth of nesting, else
/// inwards. The winding number is then 1 inside and 0 outside.
void MeshDistance::orientComponents() {
  const SurfaceComponents parts = findSurfaceComponents(mesh_.points, mesh_.triangles);
  const auto partOf = [&](const convert::Triangle& t) { return parts.componentOfVertex[t[0]]; };
  for (convert::Triangle& t : mesh_.triangles)
    if (parts.figures[partOf(t)].volume < 0) flip(t);
  if (parts.figures.size() == 1) return;
  // All components face outwards now: the winding number counts the components around a point. At
  // a corner of a component, the component itself adds a fraction.
  std::vector<V3d> corners(parts.figures.size());
  for (const convert::Triangle& t : mesh_.triangles) corners[partOf(t)] = mesh_.points[t[0]];
  std::vector<bool> isInner(corners.size());
  {
    const convert::WindingField field(mesh_);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      constexpr double kRounding = 1e-3;
      const double depth = std::floor(field.within(kRounding / 2, corners[k]) + kRounding);
      isInner[k] = std::fmod(depth, 2) == 1;
    }
  }
  for (convert::Triangle& t : mesh_.triangles)
    if (isInner[partOf(t)]) flip(t);
}

/// Orients the triangles that span holes: the winding number of the others is smaller in front.
void MeshDistance::orientSpan(std::size_t first) {
  LocalMesh given = mesh_;
  given.triangles.resize(first);
  const convert::WindingField field(given);
  for (std::size_t t = first; t < mesh_.triangles.size(); ++t) {
    const V3d &a = mesh_.corner(t, 0), &b = mesh_.corner(t, 1), &c = mesh_.corner(t, 2);
    const V3d normal = (b - a).cross(c - a);
    if (normal.length2() == 0) continue;
    const V3d centre = (a + b + c) / 3, step = normal.normalized() * 0.25;
    if (flip_ * (field.exact(centre + step) - field.exact(centre - step)) > 0)
      flip(mesh_.triangles[t]);
    if (flip_ < 0) flip(mesh_.triangles[t]);
  }
}

/// Finds the triangles whose normals tell inside from outside. Inner sheets have the inside on both
/// sides. Triangles that cross others are divided by them and do not count. The others form patches
/// with the same winding numbers beside each of their triangles, but for those near holes.
void MeshDistance::findSeparating() {
  const std::size_t count = mesh_.triangles.size();
  separates_.assign(count, true);
  for (const auto& [a, b] : convert::findSelfIntersections(mesh_.triangles, mesh_.points, {}))
    separates_[a] = separates_[b] = false;
  // Patches: triangles that share an edge with one other triangle, in opposite directions.
  DisjointSets patches(count);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> sides;
  sides.reserve(3 * count);
  for (std::uint32_t t = 0; t < count; ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t from = mesh_.triangles[t][k], to = mesh_.triangles[t][(k + 1) % 3];
      sides.emplace_back(std::min(from, to) << 32 | std::max(from, to), t);
    }
  std::sort(sides.begin(), sides.end());
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    const auto [edge, a] = sides[i];
    const auto [next, b] = sides[i + 1];
    const bool isShared = edge == next && (i == 0 || sides[i - 1].first != edge) &&
                          (i + 2 == sides.size() || sides[i + 2].first != edge);
    if (isShared && separates_[a] && separates_[b]) patches.join(a, b);
  }
  // The largest triangle of a patch decides.
  const auto areaOf = [&](std::uint32_t t) {
    return (mesh_.corner(t, 1) - mesh_.corner(t, 0)).cross(mesh_.corner(t, 2) - mesh_.corner(t, 0));
  };
  std::vector<std::uint32_t> largest(count);
  std::vector<double> area(count, -1);
  for (std::uint32_t t = 0; t < count; ++t) {
    const std::uint32_t patch = patches.find(t);
    const double own = areaOf(t).length();
    if (own > area[patch]) {
      area[patch] = own;
      largest[patch] = t;
    }
  }
  std::vector<bool> isOuter(count);
  for (std::uint32_t patch = 0; patch < count; ++patch) {
    if (patches.find(patch) != patch || !separates_[patch] || !(area[patch] > 0)) continue;
    const std::uint32_t t = largest[patch];
    const V3d centre = (mesh_.corner(t, 0) + mesh_.corner(t, 1) + mesh_.corner(t, 2)) / 3;
    constexpr double kStep = 1e-4, kTolerance = 0.02;
    const V3d step = flip_ * areaOf(t).normalized() * (kStep * std::sqrt(area[patch]));
    isOuter[patch] = flip_ * winding_.within(kTolerance, centre + step) < 0.5 &&
                     flip_ * winding_.within(kTolerance, centre - step) > 0.5;
  }
  for (std::uint32_t t = 0; t < count; ++t)
    separates_[t] = separates_[t] && isOuter[patches.find(t)];
}

/// Counts the points beside triangles that are neither clearly inside nor clearly outside.
void MeshDistance::measureAmbiguity(std::size_t given) {
  constexpr std::size_t kMost = 4000;
  constexpr double kStep = 0.25, kTolerance = 0.02, kDoubt = 0.25;
  const std::size_t stride = given / kMost + 1;
  std::size_t points = 0, ambiguous = 0;
  for (std::size_t t = 0; t < given; t += stride) {
    const V3d &a = mesh_.corner(t, 0), &b = mesh_.corner(t, 1), &c = mesh_.corner(t, 2);
    const V3d normal = (b - a).cross(c - a);
    if (normal.length2() == 0) continue;
    const V3d centre = (a + b + c) / 3, step = normal.normalized() * kStep;
    for (const V3d& p : {centre + step, centre - step}) {
      ++points;
      ambiguous += std::abs(flip_ * winding_.within(kTolerance, p) - 0.5) < kDoubt;
    }
  }
  certificate_.ambiguousShare = points > 0 ? double(ambiguous) / double(points) : 1;
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
