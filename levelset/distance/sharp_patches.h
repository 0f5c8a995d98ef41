#pragma once

// Internal header of levelset: public headers must not include it.

#include <optional>
#include <vector>

#include "levelset/geometry/triangle_tree.h"
#include "levelset/progress.h"

namespace levelset::eikonal {

/// Zero set beside the edges and corners of a solid, as triangles in index space.
/// A tricubic rounds edges by up to 0.75 voxel; planes fitted on either side do not [Ju02]. Smooth
/// surfaces get no patches, whatever their curvature: beside an edge the faces must be flat in
/// proportion to the sharpness of the edge.
class SharpPatches {
 public:
  /// Builds an empty set.
  SharpPatches() = default;
  /// Searches for edges and corners where the field bends, in the leaf blocks that touch `within`
  /// (empty: all). Only fields of unit slope yield any.
  SharpPatches(const openvdb::FloatGrid& field, const std::optional<openvdb::CoordBBox>& within,
               const Progress& progress);

  [[nodiscard]] bool isEmpty() const { return surface_.isEmpty(); }
  /// Returns true when the patches replace the interpolant in the cell whose lowest corner is
  /// `cell`.
  [[nodiscard]] bool covers(const openvdb::Coord& cell) const {
    return !isEmpty() && zone_.isValueOn(cell);
  }
  /// Returns true when the grid point is a corner of such a cell.
  [[nodiscard]] bool touches(const openvdb::Coord& gridPoint) const {
    return !isEmpty() && border_.isValueOn(gridPoint);
  }
  /// Vertices on edges and corners, in an order that depends on the field alone.
  [[nodiscard]] const std::vector<openvdb::Vec3d>& features() const { return features_; }

  /// Finds the nearest point of the patches within `limit`.
  [[nodiscard]] TriangleTree::Hit nearest(const openvdb::Vec3d& from, double limit) const {
    return surface_.nearest(from, limit);
  }

 private:
  std::vector<openvdb::Vec3d> features_;
  TriangleTree surface_;
  openvdb::MaskTree zone_, border_;
};

}  // namespace levelset::eikonal
