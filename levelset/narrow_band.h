#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace levelset {

struct VdbGrid;  // defined in levelset/vdb.h, which only .cpp files include

/// Limit of the magnitude of index coordinates. It leaves a margin to 2³¹, so that the corners of
/// the surrounding tree nodes fit into 32 bits.
inline constexpr double kIndexLimit = 2147483648.0 - 8192;

/// Number of values that importBand changed to turn an external grid into a band.
struct BandRepairs {
  std::uint64_t activeTiles = 0;  ///< active tiles that were split into voxels
  /// Inactive values that were not ± background and were set to it by their sign.
  std::uint64_t inactiveValues = 0;
};

/// A solid as a signed distance field in a narrow band on a sparse grid. Values are `float` in
/// world units, negative inside, with |∇φ| ≈ 1 in the band and ± background elsewhere.
///
/// The class has value semantics. Copies are cheap: they share one grid, which is copied before one
/// of them changes it. Grid points lie at integer index coordinates. The transform to world space
/// is a rotation, a uniform scale and a translation. Operators compute the same bits with any
/// number of threads.
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
  /// Bounds of the zero set, world units: box of all sign changes between neighbouring grid points,
  /// located by linear interpolation. Empty when there are none.
  [[nodiscard]] Imath::Box3d zeroSetBounds() const;
  /// Extents of the zero set in several directions: for each direction d the largest p·d over its
  /// points p, world units times the length of d. The points are those of zeroSetBounds(). −∞ when
  /// there are none.
  [[nodiscard]] std::vector<double> zeroSetExtents(const std::vector<Imath::V3d>& directions) const;
  /// Returns true for the band of an open surface, as surfaceBand() computes it from a mesh with a
  /// border. Such a surface has two sides and no inside: it can be the base of patches but is no
  /// solid.
  [[nodiscard]] bool isOpenSurface() const;
  /// Name of the grid in the file that the band was read from. Empty if it has none.
  [[nodiscard]] std::string name() const;
  /// Hash of transform, topology and values. Equal grids have equal hashes, whichever operator
  /// computed them.
  [[nodiscard]] std::uint64_t contentHash() const;

  /// Grid behind the band, for the .cpp files of this library; see levelset/vdb.h.
  [[nodiscard]] const std::shared_ptr<VdbGrid>& shared() const { return grid_; }
  explicit NarrowBand(std::shared_ptr<VdbGrid> grid) : grid_(std::move(grid)) {}

 private:
  friend struct VdbAccess;
  std::shared_ptr<VdbGrid> grid_;
};

/// Unbounded region in world space.
inline const Imath::Box3d kEverywhere{Imath::V3d{Imath::V3d::baseTypeLowest()},
                                      Imath::V3d{Imath::V3d::baseTypeMax()}};
[[nodiscard]] inline bool isEverywhere(const Imath::Box3d& region) {
  return region == kEverywhere;
}

/// Refuses a band that is no solid. Every operator on solids calls it first.
/// @throws InvalidInput for an open surface: "the operand is an open surface, …"
void requireSolid(const NarrowBand& band);

}  // namespace levelset
