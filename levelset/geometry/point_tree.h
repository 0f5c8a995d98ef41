#pragma once

// For the .cpp files of levelset/eikonal and levelset/solids only.

#include <cstdint>
#include <span>

#include "levelset/geometry/box_tree.h"
#include "levelset/vdb.h"

namespace levelset::eikonal {

/// Points in a tree of bounding boxes; the answers do not depend on how it was built.
class PointTree {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  /// Keeps a view of the points.
  explicit PointTree(std::span<const openvdb::Vec3d> points);
  /// Number of the point nearest to `query` and nearer than `limit`, the first of equals; else
  /// kNone.
  [[nodiscard]] std::uint32_t nearest(const openvdb::Vec3d& query, double limit) const;

 private:
  std::span<const openvdb::Vec3d> points_;
  BoxTree tree_;
};

}  // namespace levelset::eikonal
