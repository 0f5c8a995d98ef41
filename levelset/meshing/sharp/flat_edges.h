#pragma once

// Edges between flat faces, with exact planes. Internal header of levelset: public headers must not
// include it.

#include <array>
#include <optional>

#include "levelset/meshing/sharp/sharp_evidence.h"

namespace levelset {

/// Plane of a flat face in index space: the points y with normal · y = offset.
struct FlatFace {
  openvdb::Vec3d normal;  ///< unit vector, away from the solid
  double offset = 0;
  bool isNarrow = false;  ///< fitted to a narrow strip, so that the normal is less exact
  [[nodiscard]] double above(const openvdb::Vec3d& point) const {
    return normal.dot(point) - offset;
  }
};

/// A vertex on an edge between two flat faces.
struct FlatEdge {
  openvdb::Vec3d vertex;  ///< index space
  std::array<FlatFace, 2> faces;
  bool isConvex = true;
};

/// Returns the planes of the faces beside a sharp edge if both faces are flat: beyond 2 voxels from
/// the edge, the field values are those of a plane of unit slope within 3e-4 voxel. Returns none
/// for faces that end within 3 voxels of the edge.
[[nodiscard]] std::optional<FlatEdge> flatEdge(const SharpVertex& vertex,
                                               const openvdb::FloatGrid& grid,
                                               const openvdb::FloatGrid::ConstAccessor& field);

/// Point of a convex polyhedron's boundary and its signed distance, voxels.
struct PolyhedronPoint {
  double distance = 0;  ///< < 0 inside
  openvdb::Vec3d point = {};
};

/// Returns the signed distance from a point to the intersection of the half-spaces below some
/// planes, and the nearest point of its boundary.
/// @param faces  at least one and at most 8
[[nodiscard]] PolyhedronPoint nearestOnPolyhedron(const std::vector<FlatFace>& faces,
                                                  const openvdb::Vec3d& point);

}  // namespace levelset
