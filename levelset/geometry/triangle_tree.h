#pragma once

// Includes OpenVDB, so include it from .cpp files only.

#include <array>
#include <vector>

#include "levelset/geometry/box_tree.h"
#include "levelset/vdb.h"

namespace levelset {

/// Triangles in a tree of bounding boxes, for nearest-triangle searches.
class TriangleTree {
 public:
  using Triangle = std::array<openvdb::Vec3d, 3>;
  TriangleTree() = default;
  explicit TriangleTree(std::vector<Triangle> triangles);

  [[nodiscard]] bool isEmpty() const { return triangles_.empty(); }

  struct Hit {
    openvdb::Vec3d point;
    double distance = 0;
    bool found = false;
  };
  /// Finds the nearest point on the triangles that is nearer than `limit`. If there is none,
  /// `found` is false and `distance` is `limit`.
  [[nodiscard]] Hit nearest(const openvdb::Vec3d& from, double limit) const;

 private:
  BoxTree tree_;
  std::vector<Triangle> triangles_;  ///< in the order of the tree's leaves
};

}  // namespace levelset
