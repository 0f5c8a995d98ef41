#pragma once

// Private to the ray casting of segmented fields: sheets for the judge.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/segmented/sheet_surface.h"

namespace render {

/// Where a ray meets a triangle of a sheet.
struct JudgedSheet {
  double t = 0;  ///< world units
  levelset::RegionLabel label = levelset::kVoid;
  std::uint32_t triangle = 0;
};

/// All triangles of the sheets of a field that a ray meets. It works in world space, in a tree of
/// boxes. Exact predicates decide whether the ray passes through a triangle. It shares neither
/// lists nor formulas with the kernel. Thread-safe.
class SheetJudge {
 public:
  SheetJudge(std::shared_ptr<const SheetSurface> sheets, double voxelSize);

  /// Triangles that a ray meets at distances in (near, far], by distance and number.
  /// @param direction  unit length
  [[nodiscard]] std::vector<JudgedSheet> along(const Imath::V3d& origin,
                                               const Imath::V3d& direction, double near,
                                               double far) const;
  /// Unit normals at a position on a triangle, towards `-direction`.
  struct Normals {
    Imath::V3d facet, smooth;
  };
  [[nodiscard]] Normals normalsAt(std::uint32_t triangle, const Imath::V3d& position,
                                  const Imath::V3d& direction) const;

 private:
  /// Node of the tree. Its triangles are the first to the last of `order_`.
  struct Node {
    Imath::Box3d box;
    std::uint32_t first, last;
    std::uint32_t second;  ///< number of the second child; the first one follows; 0: leaf
  };
  std::uint32_t build(std::uint32_t first, std::uint32_t last);
  [[nodiscard]] const Imath::V3d& corner(std::uint32_t triangle, std::size_t k) const {
    return sheets_->positions[sheets_->triangles[triangle].corners[k]];
  }

  std::shared_ptr<const SheetSurface> sheets_;
  double voxelSize_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace render
