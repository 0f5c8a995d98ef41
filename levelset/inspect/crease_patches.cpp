#include "levelset/inspect/crease_patches.h"

#include <openvdb/tools/Morphology.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "levelset/geometry/mesh_sides.h"

namespace levelset {
namespace {

using openvdb::Coord;
using openvdb::Vec3d;

/// Distance, in voxels and along each axis, from vertices on edges of the solid within which
/// triangles are patches, and within which the stencil of the interpolant reads distances from
/// another face: it reaches two voxels along the surface, and two deep, where the faces meet at 45
/// degrees.
constexpr int kPatchReach = 5, kStencilReach = 4;
/// The same for vertices that stay on the tangent planes of their crossings.
constexpr int kFixedReach = 1;
/// Largest second difference on a grid line, and largest change by it of the share of a grid edge,
/// for one face.
constexpr double kOneFaceBend = 0.3, kOneFaceShift = 0.05;
/// Newton's method moves a vertex along the gradient: steps, longest distance and last step,
/// voxels.
constexpr int kVertexSteps = 4;
constexpr double kVertexReach = 0.2, kVertexTolerance = 1e-6;
/// Least cosine of the angle between two normals of one face beside a vertex.
constexpr double kOneFaceCosine = 0.8;
/// Cosine of the angle between two faces above which they are one along their side.
constexpr double kOneSideCosine = 0.95;
/// Largest bend of a side over its length. Above it, the side stays straight.
constexpr double kLargestBend = 0.25;

/// Cells within some voxels of the vertices on edges of the solid.
openvdb::MaskTree cellsBeside(const ExtendedSurface& mesh, int reach) {
  openvdb::MaskTree mask;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (mesh.crossing[v] == ExtendedSurface::kFeature)
      mask.setValueOn(Coord::floor(mesh.positions[v]));
  openvdb::tools::dilateActiveValues(mask, reach, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::EXPAND_TILES);
  return mask;
}

/// Moves a crossing of a grid edge to the zero of a parabola through both ends and the next grid
/// point on the side where the second difference is smaller: beside an edge of the solid, one side
/// belongs to one face only.
Vec3d onParabola(const openvdb::FloatGrid::ConstAccessor& accessor, double voxelSize,
                 const Vec3d& crossing) {
  int axis = -1;
  for (int c = 0; c < 3; ++c)
    if (crossing[c] != std::floor(crossing[c])) axis = axis < 0 ? c : 3;
  if (axis < 0 || axis > 2) return crossing;
  std::array<double, 4> value{};
  Coord at = Coord::floor(crossing);
  const double t = crossing[axis] - at[axis];
  for (int n = 0; n < 4; ++n) {
    Coord point = at;
    point[axis] += n - 1;
    value[static_cast<std::size_t>(n)] = static_cast<double>(accessor.getValue(point)) / voxelSize;
  }
  const double low = value[0] - 2 * value[1] + value[2], high = value[1] - 2 * value[2] + value[3];
  const double bend = std::abs(low) < std::abs(high) ? low : high;
  const double slope = value[2] - value[1];
  if (!(std::abs(bend) < kOneFaceBend) || !(std::abs(slope) > 2 * std::abs(bend))) return crossing;
  double zero = -value[1] / slope;
  for (int step = 0; step < kVertexSteps; ++step)
    zero -= (value[1] + slope * zero - 0.5 * bend * zero * (1 - zero)) /
            (slope - 0.5 * bend * (1 - 2 * zero));
  if (!(std::abs(zero - t) < kOneFaceShift)) return crossing;
  Vec3d moved = crossing;
  moved[axis] = at[axis] + zero;
  return moved;
}

}  // namespace

CreasePatches::CreasePatches(ExtendedSurface& mesh, const EdgeCrossings& crossings,
                             const openvdb::FloatGrid& grid)
    : mesh_(mesh) {
  normals_.resize(mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (mesh.crossing[v] != ExtendedSurface::kFeature)
      normals_[v] = crossings.at[mesh.crossing[v]].normal;
  findNear(grid);
  findNormals();
  bendSides();
}

void CreasePatches::findNear(const openvdb::FloatGrid& grid) {
  const openvdb::MaskTree crossed = cellsBeside(mesh_, kStencilReach),
                          beside = cellsBeside(mesh_, kPatchReach);
  slots_.assign(mesh_.triangles.size(), kElsewhere);
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    const auto& corners = mesh_.triangles[t];
    const bool isNear = std::any_of(corners.begin(), corners.end(), [&](std::uint32_t v) {
      return beside.isValueOn(Coord::floor(mesh_.positions[v]));
    });
    if (!isNear) continue;
    slots_[t] = static_cast<std::uint32_t>(near_.size());
    near_.push_back(static_cast<std::uint32_t>(t));
  }
  const double voxelSize = grid.voxelSize()[0];
  const openvdb::MaskTree fixed = cellsBeside(mesh_, kFixedReach);
  std::vector<std::uint32_t> moved;
  for (const std::uint32_t t : near_)
    for (const std::uint32_t v : mesh_.triangles[t])
      if (!isFeature(v) && !fixed.isValueOn(Coord::floor(mesh_.positions[v]))) moved.push_back(v);
  std::sort(moved.begin(), moved.end());
  moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, moved.size(), 512), [&](const auto& range) {
    eikonal::DenseBlockCache cache(grid.tree());
    const auto accessor = grid.getConstAccessor();
    openvdb::tree::ValueAccessor<const openvdb::MaskTree> isCrossed(crossed);
    for (std::size_t n = range.begin(); n != range.end(); ++n) {
      Vec3d p = mesh_.positions[moved[n]], normal = normals_[moved[n]];
      if (isCrossed.isValueOn(Coord::floor(p))) {
        mesh_.positions[moved[n]] = onParabola(accessor, voxelSize, p);
        continue;
      }
      for (int step = 0; step < kVertexSteps; ++step) {
        const eikonal::DenseBlock& block = cache.around(p);
        const eikonal::Jet jet = block.jet(p - block.origin().asVec3d());
        const double squared = jet.gradient.lengthSqr();
        if (!(squared > 0.25 * voxelSize * voxelSize)) break;
        const Vec3d change = jet.gradient * (-jet.value / squared);
        normal = jet.gradient / std::sqrt(squared);
        p += change;
        if (change.length() < kVertexTolerance) break;
      }
      if (!((p - mesh_.positions[moved[n]]).length() < kVertexReach)) continue;
      mesh_.positions[moved[n]] = p;
      normals_[moved[n]] = normal;
    }
  });
}

Vec3d CreasePatches::triangleNormal(std::size_t triangle) const {
  const auto& [a, b, c] = mesh_.triangles[triangle];
  Vec3d normal =
      (mesh_.positions[b] - mesh_.positions[a]).cross(mesh_.positions[c] - mesh_.positions[a]);
  normal.normalize();
  return normal;
}

void CreasePatches::findNormals() {
  // Neighbours on faces of each vertex on an edge of the solid.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> beside;
  for (const std::uint32_t t : near_)
    for (const std::uint32_t feature : mesh_.triangles[t]) {
      if (!isFeature(feature)) continue;
      for (const std::uint32_t v : mesh_.triangles[t])
        if (!isFeature(v)) beside.emplace_back(feature, v);
    }
  std::sort(beside.begin(), beside.end());
  beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  patches_.resize(near_.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, near_.size(), 512), [&](const auto& range) {
    for (std::size_t n = range.begin(); n != range.end(); ++n) {
      const auto& corners = mesh_.triangles[near_[n]];
      Vec3d face(0.0);
      for (const std::uint32_t v : corners)
        if (!isFeature(v)) face += normals_[v];
      if (!face.normalize()) face = triangleNormal(near_[n]);
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t v = corners[k];
        if (!isFeature(v)) {
          patches_[n].normal[k] = normals_[v];
          continue;
        }
        Vec3d sum(0.0);
        for (auto it = std::lower_bound(beside.begin(), beside.end(), std::pair(v, 0u));
             it != beside.end() && it->first == v; ++it) {
          const Vec3d& normal = normals_[it->second];
          if (normal.dot(face) < kOneFaceCosine) continue;
          const double squared = (mesh_.positions[it->second] - mesh_.positions[v]).lengthSqr();
          sum += normal / (squared + 0.01);
        }
        patches_[n].normal[k] = sum.normalize() ? sum : face;
      }
    }
  });
}

void CreasePatches::bendSides() {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  triangles.reserve(near_.size());
  for (const std::uint32_t t : near_) triangles.push_back(mesh_.triangles[t]);
  forEachEdge(sortedSides(triangles), [&](auto first, auto end) {
    const Vec3d from = mesh_.positions[first->low], along = mesh_.positions[first->high] - from;
    const double length = along.length();
    // Height of the bend over the face, and its direction.
    const auto heightOf = [&](const MeshSide& side, Vec3d& up) {
      const Patch& patch = patches_[side.triangle];
      const std::size_t k = side.corner, next = (k + 1) % 3;
      const Vec3d &a = patch.normal[side.rises ? k : next],
                  &b = patch.normal[side.rises ? next : k];
      up = a + b;
      if (!up.normalize()) return 0.0;
      const double height = 0.5 * (b - a).dot(along);
      return std::abs(height) <= kLargestBend * length ? height : 0.0;
    };
    Vec3d up, other, bend;
    const double height = heightOf(first[0], up);
    if (end - first != 2) {
      bend = up * height;
    } else {
      const double second = heightOf(first[1], other), cosine = up.dot(other);
      if (cosine > kOneSideCosine || cosine < -kOneSideCosine) {
        bend = (up * height + other * second) * 0.5;
      } else {  // the shortest vector with both heights
        const double share = 1 / (1 - cosine * cosine);
        bend = up * ((height - cosine * second) * share) +
               other * ((second - cosine * height) * share);
      }
      if (isFeature(first->low) && isFeature(first->high) && length > 0) {
        const double sign = first[0].rises ? 1 : -1;
        edgeCurvature_ +=
            0.5 * std::atan2(sign * up.cross(other).dot(along), cosine * length) * length;
      }
    }
    for (auto side = first; side != end; ++side) patches_[side->triangle].bend[side->corner] = bend;
    middles_.push_back({first->low, first->high, from + along * 0.5 + bend * 0.25});
  });
}

IndexMesh CreasePatches::divided() const {
  return divideSides(mesh_, middles_);
}

std::vector<bool> CreasePatches::features() const {
  std::vector<bool> result;
  for (std::uint32_t v = 0; v < mesh_.positions.size(); ++v) result.push_back(isFeature(v));
  for (const SideMiddle& middle : middles_)
    result.push_back(isFeature(middle.low) && isFeature(middle.high));
  return result;
}

SurfaceMoments CreasePatches::moments(std::size_t triangle, const Vec3d& anchor) const {
  const auto& t = mesh_.triangles[triangle];
  const Patch& patch = patches_[slots_[triangle]];
  return quadraticPatchMoments({mesh_.positions[t[0]] - anchor, mesh_.positions[t[1]] - anchor,
                                mesh_.positions[t[2]] - anchor},
                               patch.bend, patch.normal);
}

}  // namespace levelset
