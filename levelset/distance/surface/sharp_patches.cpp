#include "levelset/distance/surface/sharp_patches.h"

#include <openvdb/tools/Morphology.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <tuple>

#include "levelset/grids/box_mask_vdb.h"
#include "levelset/meshing/sharp/sharp_evidence.h"
#include "levelset/meshing/sharp/sharp_surface.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::FloatTree;
using openvdb::Vec3d;
using LeafNode = FloatTree::LeafNodeType;

// Distance along each axis from a vertex with the values of a sharp edge, voxels, within which
// cells are meshed. A confirmed edge has such a vertex within 3 voxels; the surface up to 3 voxels
// farther confirms it, and its patches reach 5 voxels. Where only some cells are of interest, their
// own vertices confirm the edges.
constexpr int kMeshReach = 9, kReachOfSome = 6;
// Number of cells around a cell with an edge in which the edge, or the bisector plane of its faces,
// affects the interpolant.
constexpr int kZone = 3;
// An edge is rejected when a part of the surface with the opposite orientation lies nearer than
// this, in voxels. Values between both parts depend on both, and planes fitted to them lie on
// neither part.
constexpr double kThin = 2;
// Two normals count as opposite when their dot product is below this value. So do the normals of an
// edge with an angle below 26°. Such an edge cannot be distinguished from the rim of a thin plate,
// so both are left to the interpolant.
constexpr double kFacesAway = -0.9;

/// Adds the leaves with a grid point within `reach` voxels, at most 8, of a point along each axis.
void touchAround(openvdb::MaskTree& leaves, const Vec3d& point, double reach) {
  for (int corner = 0; corner < 8; ++corner)
    leaves.touchLeaf(
        Coord::floor(point + Vec3d(corner & 4 ? reach : -reach, corner & 2 ? reach : -reach,
                                   corner & 1 ? reach : -reach)));
}

/// Returns the cells within kMeshReach of the vertices with the values of a sharp edge.
openvdb::MaskTree cellsNearEdges(const FloatGrid& field, const BlockSelection& within) {
  std::vector<const LeafNode*> leaves;
  for (auto it = field.tree().cbeginLeaf(); it; ++it)
    if (within.holdsBlock(it->getNodeBoundingBox())) leaves.push_back(it.getLeaf());
  std::vector<std::vector<SharpVertex>> vertices(leaves.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
    const FloatGrid::ConstAccessor accessor(field.tree());
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      vertices[i] = sharpEdgeVertices(field, accessor, leaves[i]->origin());
  });
  openvdb::MaskTree cells;
  for (const std::vector<SharpVertex>& found : vertices)
    for (const SharpVertex& vertex : found) {
      const Coord cell = Coord::floor(vertex.position);
      if (within.edgeCells && !within.edgeCells->isValueOn(cell)) continue;
      const int reach = within.edgeCells ? kReachOfSome : kMeshReach;
      addBox(cells, {cell.offsetBy(-reach), cell.offsetBy(reach)});
    }
  return cells;
}

/// Triangles of a mesh near edges and corners, sorted by the cells of their centroids. Finds the
/// parts of a solid that are thinner than kThin voxels.
class SheetTable {
 public:
  explicit SheetTable(const SharpMesh& mesh) {
    openvdb::MaskTree near;  // leaves within kThin voxels of an edge or corner
    for (std::size_t v = 0; v < mesh.sheets.size(); ++v)
      if (mesh.sheets[v].count > 1) touchAround(near, mesh.positions[v], kThin);
    const openvdb::tree::ValueAccessor<const openvdb::MaskTree> isNear(near);
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vec3d &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
      const Vec3d centroid = (p + q + r) / 3.0;
      if (!isNear.probeConstLeaf(Coord::floor(centroid))) continue;
      Vec3d normal = (q - p).cross(r - p);
      if (!normal.normalize()) continue;
      sheets_.push_back({Coord::floor(centroid), centroid, normal});
    }
    std::sort(sheets_.begin(), sheets_.end(), [](const Sheet& s, const Sheet& t) {
      return std::tie(s.cell, s.centroid) < std::tie(t.cell, t.centroid);
    });
  }
  [[nodiscard]] bool isThinAt(const Vec3d& point, const VertexSheets& own) const {
    const Coord low = Coord::floor(point - Vec3d(kThin)), high = Coord::floor(point + Vec3d(kThin));
    for (int x = low.x(); x <= high.x(); ++x)
      for (int y = low.y(); y <= high.y(); ++y) {
        const auto first = std::lower_bound(
            sheets_.begin(), sheets_.end(), Coord(x, y, low.z()),
            [](const Sheet& sheet, const Coord& cell) { return sheet.cell < cell; });
        for (auto it = first; it != sheets_.end() && it->cell <= Coord(x, y, high.z()); ++it)
          if ((it->centroid - point).lengthSqr() < kThin * kThin && facesAway(it->normal, own))
            return true;
      }
    return false;
  }

 private:
  struct Sheet {
    Coord cell;
    Vec3d centroid, normal;
  };
  [[nodiscard]] static bool facesAway(const Vec3d& normal, const VertexSheets& own) {
    for (std::size_t i = 0; i < own.count; ++i)
      if (normal.dot(sheetNormal(own, i)) < kFacesAway) return true;
    return false;
  }

  std::vector<Sheet> sheets_;
};

SharpMesh meshNearEdges(const FloatGrid& field, const BlockSelection& within,
                        const Progress& progress) {
  const openvdb::MaskTree cells = cellsNearEdges(field, within);
  if (cells.empty()) return {};
  return sharpSurface(CellSurface(field, &cells), field, progress);
}

}  // namespace

SharpPatches::SharpPatches(const FloatGrid& field, const BlockSelection& within,
                           const Progress& progress) {
  // The mesh takes more memory than the triangles, and is freed before they are sorted.
  surface_ = TriangleSearch(findTriangles(field, within, progress));
}

std::vector<TriangleItem> SharpPatches::findTriangles(const FloatGrid& field,
                                                      const BlockSelection& within,
                                                      const Progress& progress) {
  const SharpMesh mesh = meshNearEdges(field, within, progress);

  // === Confirmed edges
  const bool hasFeatures = std::any_of(mesh.sheets.begin(), mesh.sheets.end(),
                                       [](const VertexSheets& s) { return s.count > 1; });
  if (!hasFeatures) return {};
  keepThickFeatures(mesh);
  if (zone_.empty()) return {};
  openvdb::tools::dilateActiveValues(zone_, kZone, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::IGNORE_TILES);

  // === Patches around the confirmed edges
  border_.topologyUnion(zone_);
  openvdb::tools::dilateActiveValues(border_, 1, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::IGNORE_TILES);
  // The patches extend by two cells beyond the zone, the cells in which they replace the
  // interpolant. Otherwise a query at the border of the zone could find the last triangle in the
  // zone, although the surface beyond it is nearer.
  openvdb::MaskTree around(border_);
  openvdb::tools::dilateActiveValues(around, 1, openvdb::tools::NN_FACE_EDGE_VERTEX,
                                     openvdb::tools::IGNORE_TILES);
  const openvdb::tree::ValueAccessor<const openvdb::MaskTree> used(around);
  const auto isUsed = [&](const std::array<std::uint32_t, 3>& triangle) {
    return std::any_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) {
      return used.isValueOn(Coord::floor(mesh.positions[v]));
    });
  };
  std::vector<TriangleItem> triangles;
  triangles.reserve(static_cast<std::size_t>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(), isUsed)));
  for (const auto& triangle : mesh.triangles) {
    if (!isUsed(triangle)) continue;
    const auto [a, b, c] = triangle;
    triangles.push_back(
        {{toImath(mesh.positions[a]), toImath(mesh.positions[b]), toImath(mesh.positions[c])},
         static_cast<std::uint32_t>(triangles.size())});
  }
  return triangles;
}

void SharpPatches::keepThickFeatures(const SharpMesh& mesh) {
  const SheetTable table(mesh);
  for (std::size_t v = 0; v < mesh.sheets.size(); ++v) {
    if (mesh.sheets[v].count < 2 || table.isThinAt(mesh.positions[v], mesh.sheets[v])) continue;
    features_.push_back(mesh.positions[v]);
    zone_.setValueOn(Coord::floor(mesh.positions[v]));
  }
}

SharpPatches::Hit SharpPatches::nearest(const Vec3d& from, double limit) const {
  const auto [found, triangle] = surface_.closestItem(toImath(from), limit * limit);
  if (!triangle) return {Vec3d(0), limit, false};
  return {toVdb(triangle->closestPoint(toImath(from))), std::sqrt(found.squared), true};
}

}  // namespace levelset::eikonal
