#include "levelset/deform/creases/restore_creases.h"

#include <openvdb/tools/Interpolation.h>
#include <openvdb/tree/LeafManager.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "levelset/convert/mesh_to_band.h"
#include "levelset/geometry/mesh_sides.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

using Imath::V3d;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;

/// Distance from an edge at which gradients are compared, voxels.
constexpr double kBesideEdge = 1.25;

V3d areaNormal(const TriMesh& mesh, std::uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  return (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
}

/// Finds if the closest point of the surface lies near a crease.
class CreaseRegion {
 public:
  CreaseRegion(const TriMesh& mesh, const std::vector<std::array<std::uint32_t, 2>>& creases,
               double width)
      : squaredWidth_(width * width) {
    std::vector<TriangleItem> items;
    for (const auto& [a, b] : creases)
      items.push_back({{mesh.positions[a], mesh.positions[b], mesh.positions[b]},
                       static_cast<std::uint32_t>(items.size())});
    tree_ = TriangleSearch(std::move(items));
  }
  /// On a plane, the closest point has the distance `width` from the crease if the squared distance
  /// of the position from the crease is that from the plane plus `width`².
  [[nodiscard]] bool contains(const V3d& world, double distance) const {
    return tree_.closestItem(world, distance * distance + squaredWidth_).second != nullptr;
  }

 private:
  TriangleSearch tree_;
  double squaredWidth_;
};

}  // namespace

std::vector<std::array<std::uint32_t, 2>> creaseEdges(const NarrowBand& band, const TriMesh& mesh,
                                                      double angleDegrees) {
  const double least = std::cos(angleDegrees * std::numbers::pi / 180);
  const FloatGrid& grid = vdb(band);
  const auto accessor = grid.getConstAccessor();
  const double voxelSize = band.voxelSize();
  // Along the axes of the grid, which may be rotated. Only angles between gradients are compared.
  const auto gradientAt = [&](const V3d& world) {
    V3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      openvdb::Vec3d p = grid.worldToIndex(openvdb::Vec3d(world.x, world.y, world.z));
      p[axis] += 0.5;
      gradient[axis] = static_cast<double>(openvdb::tools::BoxSampler::sample(accessor, p));
      p[axis] -= 1;
      gradient[axis] -= static_cast<double>(openvdb::tools::BoxSampler::sample(accessor, p));
    }
    return gradient;
  };
  const auto turns = [&](const V3d& a, const V3d& b) {
    return a.dot(b) < least * a.length() * b.length();
  };
  std::vector<std::array<std::uint32_t, 2>> edges;
  forEachEdge(sortedSides(mesh.triangles), [&](auto first, auto end) {
    if (end - first != 2) return;
    const V3d a = areaNormal(mesh, first[0].triangle), b = areaNormal(mesh, first[1].triangle);
    if (!turns(a, b)) return;
    const V3d from = mesh.positions[first->low], along = mesh.positions[first->high] - from;
    // In the planes of the triangles, away from the edge.
    const V3d middle = from + along * 0.5;
    const double sign = first[0].rises ? 1 : -1;
    const V3d left = a.cross(along).normalized() * sign,
              right = b.cross(along).normalized() * -sign;
    const double step = kBesideEdge * voxelSize;
    if (turns(gradientAt(middle + left * step), gradientAt(middle + right * step)))
      edges.push_back({first->low, first->high});
  });
  return edges;
}

NarrowBand restoreCreases(const NarrowBand& band, const TriMesh& mesh,
                          const std::vector<std::array<std::uint32_t, 2>>& creases,
                          const RestoreCreasesOptions& options) {
  const double voxelSize = band.voxelSize();
  const NarrowBand sharp = meshToBand(mesh, voxelSize,
                                      {.halfWidth = band.halfWidth(),
                                       .maxMemory = options.maxMemory,
                                       .progress = options.progress})
                               .band;
  const CreaseRegion region(mesh, creases, options.widthVoxels * voxelSize);
  const FloatGrid& smoothGrid = vdb(band);
  const FloatGrid::Ptr result = vdb(sharp).deepCopy();
  FloatTree& tree = result->tree();
  tree.topologyUnion(smoothGrid.tree());
  const FloatTree& sharpTree = vdb(sharp).tree();
  openvdb::tree::LeafManager<FloatTree> leaves(tree);
  leaves.foreach ([&](FloatTree::LeafNodeType& leaf, std::size_t) {
    const auto smooth = smoothGrid.getConstAccessor();
    openvdb::tree::ValueAccessor<const FloatTree> exact(sharpTree);
    for (auto it = leaf.beginValueOn(); it; ++it) {
      const Coord at = it.getCoord();
      const float value = exact.getValue(at);
      const bool isOn = exact.isValueOn(at);
      const float reference = isOn ? value : smooth.getValue(at);
      const bool isSharp = region.contains(V3d(at.x(), at.y(), at.z()) * voxelSize,
                                           std::abs(static_cast<double>(reference)));
      it.setValue(isSharp ? value : smooth.getValue(at));
      if (!(isSharp ? isOn : smooth.isValueOn(at))) it.setValueOff();
    }
  });
  return makeBand(result);
}

}  // namespace levelset
