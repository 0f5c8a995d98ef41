#pragma once

// Internal header of levelset: public headers must not include it.

#include <optional>
#include <vector>

#include "levelset/geometry/triangle_tree.h"
#include "levelset/progress.h"

namespace levelset::eikonal {

/// The zero set beside the edges and corners of a solid, as triangles in index space. A tricubic
/// rounds them by up to 0.75 voxel; planes fitted on either side do not [Ju02]. Smooth surfaces
/// have no patches, whatever their curvature: the faces that meet must stay as flat beside the edge
/// as the edge is sharp.
class SharpPatches {
 public:
  /// None.
  SharpPatches() = default;
  /// Looks for them where the field bends. Only fields of unit slope show any.
  /// Among the leaf blocks that touch `within`, all if empty.
  SharpPatches(const openvdb::FloatGrid& field, const std::optional<openvdb::CoordBBox>& within,
               const Progress& progress);

  [[nodiscard]] bool isEmpty() const { return surface_.isEmpty(); }
  /// Do the patches stand for the interpolant in the cell whose lowest corner this is?
  [[nodiscard]] bool covers(const openvdb::Coord& cell) const {
    return !isEmpty() && zone_.isValueOn(cell);
  }
  /// Is the grid point a corner of such a cell?
  [[nodiscard]] bool touches(const openvdb::Coord& gridPoint) const {
    return !isEmpty() && border_.isValueOn(gridPoint);
  }
  /// Vertices on edges and corners, in an order that depends on the field alone.
  [[nodiscard]] const std::vector<openvdb::Vec3d>& features() const { return features_; }

  /// The nearest point of the patches that is nearer than `limit`.
  [[nodiscard]] TriangleTree::Hit nearest(const openvdb::Vec3d& from, double limit) const {
    return surface_.nearest(from, limit);
  }

 private:
  std::vector<openvdb::Vec3d> features_;
  TriangleTree surface_;
  openvdb::MaskTree zone_, border_;
};

}  // namespace levelset::eikonal
