#pragma once

// Includes OpenVDB: for .cpp files only.

#include <array>
#include <cstdint>
#include <vector>

#include "levelset/vdb.h"

namespace levelset {

/// Triangles in a tree of bounding boxes, to find the nearest of them.
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
  /// The nearest point of the triangles that is nearer than `limit`.
  [[nodiscard]] Hit nearest(const openvdb::Vec3d& from, double limit) const;

 private:
  struct Node {
    openvdb::Vec3f low, high;
    std::uint32_t begin = 0, end = 0;  ///< triangles
    std::uint32_t right = 0;           ///< second child; the first follows; 0: a leaf
  };
  struct Search;
  std::uint32_t build(std::uint32_t begin, std::uint32_t end);

  std::vector<Triangle> triangles_;  ///< in the order of the tree's leaves
  std::vector<Node> nodes_;
};

}  // namespace levelset
