#pragma once

// Tests whether field values are those of a sharp edge. Internal header of levelset: public headers
// must not include it.

#include <array>
#include <vector>

#include "levelset/meshing/sharp/sharp_features.h"

namespace levelset {

/// Largest distance of a feature (a vertex with several sheets) from the planes of its sheets,
/// voxels.
inline constexpr double kFeatureMisfit = 0.1;

/// Number of grid points examined beside an edge, and number whose values contradict a sharp edge.
/// Index 0 assumes a convex edge, index 1 a concave one.
struct EdgeEvidence {
  std::array<std::size_t, 2> points = {}, odd = {};

  void add(const EdgeEvidence& other);
  [[nodiscard]] bool isSharp() const;
};

/// Compares the field around a vertex with two sheets to that of a sharp edge. Inside a convex
/// edge, the values must equal the distance to the nearer plane; beyond the edge, they must not
/// exceed the distance to the edge. For a concave edge the same holds with the opposite signs.
/// @param vertex  position in index space
[[nodiscard]] EdgeEvidence edgeEvidence(const openvdb::Vec3d& vertex, const VertexSheets& sheets,
                                        const openvdb::FloatGrid& grid,
                                        const openvdb::FloatGrid::ConstAccessor& field);

/// Vertex of the dual mesh at which the field is that of a sharp edge.
struct SharpVertex {
  openvdb::Vec3d position;  ///< index space
  VertexSheets sheets;      ///< two
};

/// Returns the vertices in the cells of one leaf block at which the field is that of a sharp edge.
/// Every edge that confirmFeatures() confirms has such a vertex within 3 voxels of
/// each of its vertices. So a search for edges can skip the blocks without one. Cells that are
/// smooth at all corners are skipped.
/// @param cells  only in these cells, given by their lowest corners; null: in all
[[nodiscard]] std::vector<SharpVertex> sharpEdgeVertices(
    const openvdb::FloatGrid& grid, const openvdb::FloatGrid::ConstAccessor& field,
    const openvdb::Coord& origin, const openvdb::MaskTree::LeafNodeType* cells = nullptr);

}  // namespace levelset
