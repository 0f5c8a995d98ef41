#pragma once

// Internal header of levelset: public headers must not include it.

#include <vector>

#include "levelset/distance/surface/block_selection.h"
#include "levelset/geometry/search/triangle_search.h"
#include "levelset/progress.h"

namespace levelset {
struct SharpMesh;
}

namespace levelset::eikonal {

/// Zero set near the edges and corners of a solid, as triangles in index space. Tricubic
/// interpolation rounds edges by up to 0.75 voxel; the intersection of planes fitted to both faces
/// does not [Ju02]. Smooth surfaces get no patches, whatever their curvature: the less the surface
/// turns at an edge, the flatter the faces beside it must be to count as an edge.
class SharpPatches {
 public:
  /// Builds an empty set.
  SharpPatches() = default;
  /// Searches for edges and corners in the leaf blocks `within`. Finds them only in fields of unit
  /// slope.
  SharpPatches(const openvdb::FloatGrid& field, const BlockSelection& within,
               const Progress& progress);

  /// Point of the patches.
  struct Hit {
    openvdb::Vec3d point;
    double distance = 0;
    bool found = false;
  };

  [[nodiscard]] bool isEmpty() const { return surface_.isEmpty(); }
  void clear() {
    features_ = {};
    surface_ = {};
    zone_.clear();
    border_.clear();
  }
  /// Returns true when the patches replace the interpolant in the cell whose lowest corner is
  /// `cell`.
  [[nodiscard]] bool covers(const openvdb::Coord& cell) const {
    return !isEmpty() && zone_.isValueOn(cell);
  }
  /// Returns true when the grid point may be a corner of a cell for which covers() is true.
  [[nodiscard]] bool touches(const openvdb::Coord& gridPoint) const {
    return !isEmpty() && border_.isValueOn(gridPoint);
  }
  /// Returns the vertices of the patches that lie on edges and corners, in index space. Their order
  /// depends on the field only.
  [[nodiscard]] const std::vector<openvdb::Vec3d>& features() const { return features_; }

  /// Finds the nearest point of the patches that is nearer than `limit` voxels. If there is none,
  /// `found` is false and `distance` is `limit`.
  [[nodiscard]] Hit nearest(const openvdb::Vec3d& from, double limit) const;

 private:
  /// Returns the triangles of the patches. Sets all members but surface_.
  [[nodiscard]] std::vector<TriangleItem> findTriangles(const openvdb::FloatGrid& field,
                                                        const BlockSelection& within,
                                                        const Progress& progress);
  void keepThickFeatures(const SharpMesh& mesh);

  std::vector<openvdb::Vec3d> features_;
  TriangleSearch surface_;
  openvdb::MaskTree zone_, border_;
};

}  // namespace levelset::eikonal
