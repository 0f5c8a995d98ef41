#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <vector>

#include "levelset/deform/deformation.h"

namespace levelset::cage {

/// Cells of a regular grid that cover a domain: those near triangles, and those that they enclose.
/// The cells are a power of two along each axis, as the lowest level of an octree. Internal.
class DomainCells {
 public:
  static constexpr int kLevels = 7;  ///< halvings of the root; 128 cells along an axis

  /// @pre the domain has triangles
  explicit DomainCells(const DeformationDomain& domain);

  /// Cube of the octree. `level` counts halvings of the root and may exceed kLevels.
  struct Cube {
    int level = 0;
    std::array<std::uint32_t, 3> at = {0, 0, 0};
  };
  [[nodiscard]] double edgeOf(const Cube& cube) const;
  [[nodiscard]] Imath::V3d centreOf(const Cube& cube) const;
  /// Returns true if a cell of the domain lies in the cube or contains it.
  [[nodiscard]] bool touches(const Cube& cube) const;
  /// Returns true for a point in a cell of the domain.
  [[nodiscard]] bool contains(const Imath::V3d& world) const;

 private:
  static constexpr std::uint32_t kSide = 1u << kLevels;
  [[nodiscard]] static std::size_t indexOf(std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    return (static_cast<std::size_t>(i) * kSide + j) * kSide + k;
  }
  /// Marks all cells whose centres are within a distance of that of a marked one.
  void widen(double cells);
  void floodOutside();

  Imath::V3d low_;
  double cell_ = 0;
  std::vector<std::uint8_t> isPart_;
};

}  // namespace levelset::cage
