#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace levelset {

struct VdbGrid;  // levelset/vdb.h, for .cpp files only

/// Limit of the magnitude of index coordinates. The margin keeps the coordinates of the surrounding
/// tree nodes within 32 bits.
inline constexpr double kIndexLimit = 2147483648.0 - 8192;

/// Repairs that importBand made to turn an external grid into a band.
struct BandRepairs {
  std::uint64_t activeTiles = 0;     ///< active tiles that were split into voxels
  std::uint64_t inactiveValues = 0;  ///< inactive values other than ± background, set to it by
                                     ///< their sign
};

/// A solid as a signed distance field in a narrow band on a sparse grid. Values are `float` in
/// world units, negative inside, with |∇φ| ≈ 1 in the band and ± background elsewhere.
///
/// The class has value semantics. Copies are cheap: they share one const grid, and an edit of one
/// copy does not affect the others. Grid points lie at integer index coordinates. The transform to
/// world space is a rotation, a uniform scale and a translation. The bits of the tree do not depend
/// on the number of threads.
class NarrowBand {
 public:
  NarrowBand() = default;

  /// Returns true when the band has no active voxel: there is no surface.
  [[nodiscard]] bool isEmpty() const;
  /// Edge length of a voxel, world units.
  [[nodiscard]] double voxelSize() const;
  /// Width of the band on each side of the surface, in voxels. The background is halfWidth ×
  /// voxelSize.
  [[nodiscard]] double halfWidth() const;
  [[nodiscard]] std::size_t activeVoxelCount() const;
  /// Memory of the tree in bytes.
  [[nodiscard]] std::size_t memoryUse() const;
  /// Transform from index to world space. Imath multiplies row vectors: `world = index * matrix`.
  [[nodiscard]] Imath::M44d indexToWorld() const;
  /// World-space box of the sign changes between neighbouring grid points, located by linear
  /// interpolation. Empty when there are none.
  [[nodiscard]] Imath::Box3d zeroSetBounds() const;
  /// Returns true for the band of a surface with a border (surfaceBand). The band ends at the
  /// border. Such a surface has two sides and no inside: it can be the base of patches but is no
  /// solid.
  [[nodiscard]] bool isOpenSurface() const;
  /// Name of the grid, where the band comes from a file that gives one.
  [[nodiscard]] std::string name() const;
  /// Hash of transform, topology and values. Equal trees have equal hashes, whichever operator
  /// computed them.
  [[nodiscard]] std::uint64_t contentHash() const;

  /// Grid behind the band, for the .cpp files of this library; see levelset/vdb.h.
  [[nodiscard]] const std::shared_ptr<VdbGrid>& shared() const { return grid_; }
  explicit NarrowBand(std::shared_ptr<VdbGrid> grid) : grid_(std::move(grid)) {}

 private:
  friend struct VdbAccess;
  std::shared_ptr<VdbGrid> grid_;
};

/// Unbounded region.
inline const Imath::Box3d kEverywhere{Imath::V3d{Imath::V3d::baseTypeLowest()},
                                      Imath::V3d{Imath::V3d::baseTypeMax()}};
[[nodiscard]] inline bool isEverywhere(const Imath::Box3d& region) {
  return region == kEverywhere;
}

/// Refuses a band that is no solid. Every operator on solids calls it first.
/// @throws InvalidInput for an open surface: "the operand is an open surface, …"
void requireSolid(const NarrowBand& band);

}  // namespace levelset
