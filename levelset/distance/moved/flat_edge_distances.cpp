#include "levelset/distance/moved/flat_edge_distances.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <unordered_map>
#include <vector>

#include "levelset/distance/moved/leaf_distances.h"
#include "levelset/grids/box_mask_vdb.h"
#include "levelset/meshing/sharp/flat_edges.h"

namespace levelset::eikonal {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::MaskTree;
using openvdb::Vec3d;
using LeafNode = openvdb::FloatTree::LeafNodeType;

// Distances from a vertex on an edge, voxels, at which the faces beside it are known to be flat: on
// the face, and along the edge; kAlongNarrow for faces that were fitted to a narrow strip. Where
// two such edges lead to a corner, their last vertices are at most kToCorner from it.
constexpr double kBesideFlatEdge = 3.5, kAlongFlatEdge = 1.5, kAlongNarrow = 0.5, kToCorner = 6;
// Distance along each axis, voxels, within which an edge has a grid point with a wrong value.
constexpr int kToFlatEdge = 2;
// Distances to a rounding are at most off by kMostFlatChange, voxels. Values that differ by less
// than kLeastFlatChange from the distance to flat faces are as exact as these.
constexpr double kMostFlatChange = 0.05, kLeastFlatChange = 3e-4;
// Faces count as the same if the dot product of their unit normals is larger. Number of faces that
// may meet in a corner, and least determinant of the unit normals of three of them.
constexpr double kSameFace = 0.99;
constexpr std::size_t kMostFaces = 6;
constexpr double kLeastDeterminant = 0.1;

/// Returns true if three of the planes meet in a point.
bool haveCorner(const std::vector<FlatFace>& faces) {
  for (std::size_t i = 2; i < faces.size(); ++i)
    for (std::size_t j = 1; j < i; ++j)
      for (std::size_t k = 0; k < j; ++k)
        if (std::abs(faces[i].normal.dot(faces[j].normal.cross(faces[k].normal))) >
            kLeastDeterminant)
          return true;
  return false;
}

/// Edges between flat faces of a field, by position.
class FlatEdges {
 public:
  /// Searches for them near the grid points `near`.
  FlatEdges(const FloatGrid& field, const MaskTree& near) {
    // A vertex lies in its cell or close beside it.
    const MaskTree cells = boxesAround(near, kToFlatEdge + 1);
    const auto blocks = leavesOf(cells);
    std::vector<std::vector<FlatEdge>> found(blocks.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks.size(), 16),
                      [&](const auto& range) {
                        const FloatGrid::ConstAccessor accessor(field.tree());
                        for (std::size_t i = range.begin(); i != range.end(); ++i) {
                          if (!accessor.probeConstLeaf(blocks[i]->origin())) continue;
                          for (const SharpVertex& v :
                               sharpEdgeVertices(field, accessor, blocks[i]->origin(), blocks[i]))
                            if (const auto edge = flatEdge(v, field, accessor);
                                edge && hasPointBeside(near, edge->vertex))
                              found[i].push_back(*edge);
                        }
                      });
    for (std::size_t i = 0; i < blocks.size(); ++i)
      if (!found[i].empty()) edges_[blocks[i]->origin()] = std::move(found[i]);
  }

  /// Returns the grid points within `reach` voxels of an edge along each axis.
  [[nodiscard]] MaskTree pointsWithin(double reach) const {
    MaskTree points;
    for (const auto& [origin, edges] : edges_)
      for (const FlatEdge& edge : edges) {
        CoordBBox box(Coord::round(edge.vertex), Coord::round(edge.vertex));
        box.expand(static_cast<int>(std::ceil(reach)));
        addBox(points, box);
      }
    return points;
  }

  /// Returns the signed distance of a point from the surface of the flat faces beside the edges
  /// near its closest point, voxels. Returns none if there are none, or both convex and concave
  /// ones.
  /// @param reach  largest distance of the point from an edge, voxels
  [[nodiscard]] std::optional<double> distance(const Vec3d& point, double reach) const {
    std::vector<Near> near;
    const Coord low = Coord::floor(point - Vec3d(reach)) & ~7,
                high = Coord::floor(point + Vec3d(reach)) & ~7;
    for (int x = low.x(); x <= high.x(); x += 8)
      for (int y = low.y(); y <= high.y(); y += 8)
        for (int z = low.z(); z <= high.z(); z += 8) {
          const auto block = edges_.find({x, y, z});
          if (block == edges_.end()) continue;
          for (const FlatEdge& edge : block->second) {
            if ((edge.vertex - point).lengthSqr() > reach * reach) continue;
            const auto faces = convexFaces(edge);
            const Vec3d foot = nearestOnPolyhedron({faces.begin(), faces.end()}, point).point;
            Vec3d direction = faces[0].normal.cross(faces[1].normal);
            direction.normalize();
            const double along = (foot - edge.vertex).dot(direction),
                         across = std::sqrt((foot - edge.vertex).lengthSqr() - along * along);
            if (std::abs(along) < kToCorner && across < kBesideFlatEdge)
              near.push_back({std::abs(along), &edge});
          }
        }
    if (near.empty()) return std::nullopt;
    std::stable_sort(near.begin(), near.end(),
                     [](const Near& a, const Near& b) { return a.along < b.along; });
    const bool isConvex = near.front().edge->isConvex;
    std::vector<FlatFace> faces;
    for (const Near& one : near) {
      if (one.edge->isConvex != isConvex) return std::nullopt;
      for (const FlatFace& face : convexFaces(*one.edge)) {
        const auto known = std::find_if(faces.begin(), faces.end(), [&](const FlatFace& other) {
          return other.normal.dot(face.normal) > kSameFace;
        });
        if (known == faces.end())
          faces.push_back(face);
        else if (known->isNarrow && !face.isNarrow)
          *known = face;
      }
      if (faces.size() > kMostFaces) return std::nullopt;
    }
    const bool isAlong = std::any_of(near.begin(), near.end(), [](const Near& one) {
      const auto& [first, second] = one.edge->faces;
      return one.along < (first.isNarrow || second.isNarrow ? kAlongNarrow : kAlongFlatEdge);
    });
    if (!isAlong && !haveCorner(faces)) return std::nullopt;
    const double found = nearestOnPolyhedron(faces, point).distance;
    return isConvex ? found : -found;
  }

 private:
  /// Returns true if one of the grid points is within kToFlatEdge voxels along each axis.
  [[nodiscard]] static bool hasPointBeside(const MaskTree& points, const Vec3d& vertex) {
    CoordBBox box(Coord::round(vertex), Coord::round(vertex));
    box.expand(kToFlatEdge);
    for (const Coord& c : box)
      if (points.isValueOn(c)) return true;
    return false;
  }

  struct Near {
    double along = 0;  ///< distance of the closest point from the vertex along the edge, voxels
    const FlatEdge* edge = nullptr;
  };
  /// Faces of the solid if the edge is convex, else those of its complement.
  [[nodiscard]] static std::array<FlatFace, 2> convexFaces(const FlatEdge& edge) {
    std::array<FlatFace, 2> faces = edge.faces;
    if (!edge.isConvex)
      for (FlatFace& face : faces) face = {-face.normal, -face.offset, face.isNarrow};
    return faces;
  }

  std::unordered_map<Coord, std::vector<FlatEdge>, std::hash<Coord>> edges_;  ///< by leaf block
};

}  // namespace

void measureFlatEdges(FloatGrid& field, const MaskTree& wrong, double halfWidth) {
  const FlatEdges edges(field, wrong);
  const MaskTree points = edges.pointsWithin(halfWidth + kToCorner);
  const auto masks = leavesOf(points);
  std::vector<LeafDistances> found(masks.size());
  const double voxelSize = field.voxelSize()[0];
  tbb::parallel_for(std::size_t{0}, masks.size(), [&](std::size_t i) {
    const LeafNode* leaf = field.tree().probeConstLeaf(masks[i]->origin());
    if (!leaf) return;
    for (auto it = masks[i]->cbeginValueOn(); it; ++it) {
      if (!leaf->isValueOn(it.pos())) continue;
      const double old = static_cast<double>(leaf->getValue(it.pos())) / voxelSize;
      const auto value = edges.distance(it.getCoord().asVec3d(), std::abs(old) + kToCorner);
      if (!value) continue;
      const double change = std::abs(*value - old);
      if (change > kLeastFlatChange && change < kMostFlatChange)
        found[i].emplace_back(it.pos(), *value);
    }
  });
  for (std::size_t i = 0; i < masks.size(); ++i)
    setAll(field, masks[i]->origin(), found[i], halfWidth);
}

}  // namespace levelset::eikonal
