#pragma once

// Where a cell's vertex lies on a surface with edges and corners. Includes OpenVDB and Eigen: for
// .cpp files only.

#include <Eigen/Dense>
#include <memory>
#include <vector>

#include "levelset/meshing/sharp_features.h"

namespace levelset {

/// Points x with normal · x = offset.
struct FacePlane {
  Eigen::Vector3d normal;
  double offset = 0;
  double error = 0;  ///< how far the values that told it are from it, voxels
  double bend = 0;   ///< second difference of these, voxels
  [[nodiscard]] double above(const Eigen::Vector3d& p) const { return normal.dot(p) - offset; }
};

/// The point nearest to `centre` among those that fit the planes best [Ju02].
[[nodiscard]] Eigen::Vector3d fitPlanes(const std::vector<FacePlane>& planes,
                                        const Eigen::Vector3d& centre);
/// The planes that pass through a point, one of each sheet.
[[nodiscard]] VertexSheets sheetsAt(const Eigen::Vector3d& point,
                                    const std::vector<FacePlane>& planes);

struct DualVertex {
  Eigen::Vector3d position;  ///< where the planes told by the grid points around meet, voxels
  VertexSheets sheets = {};  ///< those planes
  Eigen::Vector3d smooth;    ///< where the vertex lies if no edge is near, voxels
  double misfit = 0;         ///< largest distance of the position to a plane, voxels
  double bend = 1;           ///< largest second difference where the planes come from, voxels
};

/// Places the vertices of the cells of one block, positions relative to its origin.
class VertexPlacer {
 public:
  VertexPlacer(const openvdb::FloatGrid& grid, const openvdb::Coord& origin);
  ~VertexPlacer();
  /// The vertex of a polygon of the cell at x, y, z, by the crossed edges of that.
  [[nodiscard]] DualVertex place(int x, int y, int z, const std::uint8_t* edges, std::size_t count);

 private:
  struct Plane;
  class BlockField;
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace levelset
