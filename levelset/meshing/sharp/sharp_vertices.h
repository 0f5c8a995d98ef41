#pragma once

// Position of the vertex of a cell in the dual mesh of a surface with edges and corners. Internal
// header of levelset: public headers must not include it.

#include <Eigen/Dense>
#include <memory>
#include <vector>

#include "levelset/meshing/sharp/sharp_features.h"

namespace levelset {

/// Plane of the points x with normal · x = offset.
struct FacePlane {
  Eigen::Vector3d normal;
  double offset = 0;
  double error = 0;  ///< deviation of the plane from the field values that define it, voxels
  double bend = 0;   ///< largest second difference of those values, voxels
  [[nodiscard]] double above(const Eigen::Vector3d& p) const { return normal.dot(p) - offset; }
};

/// Returns the point nearest to `centre` among the points that fit the planes best by least squares
/// [Ju02].
[[nodiscard]] Eigen::Vector3d fitPlanes(const std::vector<FacePlane>& planes,
                                        const Eigen::Vector3d& centre);
/// Returns the normals of the planes that pass within 0.05 voxels of a point, one for each sheet.
[[nodiscard]] VertexSheets sheetsAt(const Eigen::Vector3d& point,
                                    const std::vector<FacePlane>& planes);

struct DualVertex {
  /// Point where the tangent planes estimated at the cell's grid points meet, voxels.
  Eigen::Vector3d position;
  VertexSheets sheets = {};  ///< normals of these planes
  Eigen::Vector3d smooth;    ///< position of the vertex if no edge is near, voxels
  double misfit = 0;         ///< largest distance of `position` from one of the planes, voxels
  double bend = 1;  ///< largest second difference of the values that define the planes, voxels
};

/// Computes the vertices of the dual mesh in the cells of one block of 8³ voxels. Positions are in
/// voxels, relative to the block's origin.
class VertexPlacer {
 public:
  VertexPlacer(const openvdb::FloatGrid& grid, const openvdb::Coord& origin);
  ~VertexPlacer();
  /// Returns the vertex of a polygon of the cell (x, y, z), given the polygon's `count` crossed
  /// edges, numbered as in cell_table.h.
  [[nodiscard]] DualVertex place(int x, int y, int z, const std::uint8_t* edges, std::size_t count);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace levelset
