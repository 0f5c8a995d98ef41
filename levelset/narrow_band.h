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

/// Index coordinates stay below this, so that those of the nodes around them do not overflow 32
/// bits.
inline constexpr double kIndexLimit = 2147483648.0 - 8192;

/// What a grid from outside lacked to be a band.
struct BandRepairs {
  std::uint64_t activeTiles = 0;     ///< were split into voxels
  std::uint64_t inactiveValues = 0;  ///< were not ± background, and were set to it by their sign
};

/// A solid as a signed distance in a narrow band on a sparse grid: `float` values in world units,
/// negative inside, |∇φ| ≈ 1 in the band, ± background elsewhere.
///
/// A value: copies share one grid and show it as const, so they are cheap and nobody sees another's
/// edit. Grid points sit at integer index coordinates; the transform to world space is a rotation,
/// a uniform scale and a translation. The bits of the tree do not depend on the number of threads.
class NarrowBand {
 public:
  NarrowBand() = default;

  /// True when the band has no active voxel: there is no surface.
  [[nodiscard]] bool isEmpty() const;
  /// Edge of a voxel, world units.
  [[nodiscard]] double voxelSize() const;
  /// Distance to which the band reaches on each side, in voxels; background = halfWidth ×
  /// voxelSize.
  [[nodiscard]] double halfWidth() const;
  [[nodiscard]] std::size_t activeVoxelCount() const;
  /// Bytes that the tree takes.
  [[nodiscard]] std::size_t memoryUse() const;
  /// Index to world; Imath multiplies row vectors: `world = index * matrix`.
  [[nodiscard]] Imath::M44d indexToWorld() const;
  /// World-space box of the zero set's sign changes (between voxel centres, by linear
  /// interpolation); empty when there are none.
  [[nodiscard]] Imath::Box3d zeroSetBounds() const;
  /// Is it the band about a surface with a border (surfaceBand), cut off beyond that? It has two
  /// sides and no inside: a base for patches, and no solid.
  [[nodiscard]] bool isOpenSurface() const;
  /// Of its grid, where it came from a file that gave one.
  [[nodiscard]] std::string name() const;
  /// Hash of transform, topology and values: equal for equal trees, whatever made them.
  [[nodiscard]] std::uint64_t contentHash() const;

  /// For our own .cpp files; see levelset/vdb.h.
  [[nodiscard]] const std::shared_ptr<VdbGrid>& shared() const { return grid_; }
  explicit NarrowBand(std::shared_ptr<VdbGrid> grid) : grid_(std::move(grid)) {}

 private:
  friend struct VdbAccess;
  std::shared_ptr<VdbGrid> grid_;
};

/// A region that ends nowhere, and is it one?
inline const Imath::Box3d kEverywhere{Imath::V3d{Imath::V3d::baseTypeLowest()},
                                      Imath::V3d{Imath::V3d::baseTypeMax()}};
[[nodiscard]] inline bool isEverywhere(const Imath::Box3d& region) {
  return region == kEverywhere;
}

/// What every operator on solids asks first.
/// @throws InvalidInput for an open surface: "measure: the operand is an open surface, …"
void requireSolid(const NarrowBand& band, const char* action);

}  // namespace levelset
