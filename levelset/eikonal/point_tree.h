#pragma once

// For the .cpp files of levelset/eikonal and levelset/solids only.

#include <cstdint>
#include <span>
#include <vector>

#include "levelset/vdb.h"

namespace levelset::eikonal {

/// A balanced k-d tree over points; the answers do not depend on how it was built.
class PointTree {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  /// Keeps a view of the points.
  explicit PointTree(std::span<const openvdb::Vec3d> points);
  /// Number of the point nearest to `query` and nearer than `limit`, the first of equals; else
  /// kNone.
  [[nodiscard]] std::uint32_t nearest(const openvdb::Vec3d& query, double limit) const;

 private:
  struct Search;
  void build(std::size_t begin, std::size_t end);

  std::span<const openvdb::Vec3d> points_;
  std::vector<std::uint32_t> order_;  ///< the middle of a range splits it
  std::vector<std::uint8_t> axes_;    ///< along this axis
};

}  // namespace levelset::eikonal
