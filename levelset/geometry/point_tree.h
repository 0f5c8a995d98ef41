#pragma once

// For the .cpp files of levelset only.

#include <cstdint>
#include <span>

#include "levelset/geometry/box_tree.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Points in a tree of bounding boxes, for nearest-point searches. Results do not depend on the
/// structure of the tree.
class PointTree {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  /// Keeps a view of the points: the caller keeps them alive.
  explicit PointTree(std::span<const openvdb::Vec3d> points);
  /// Index of the point that is nearest to `query` and nearer than `limit`; the lowest index among
  /// points at equal distance. kNone when there is no such point.
  [[nodiscard]] std::uint32_t nearest(const openvdb::Vec3d& query, double limit) const;

 private:
  std::span<const openvdb::Vec3d> points_;
  BoxTree tree_;
};

}  // namespace levelset::eikonal
