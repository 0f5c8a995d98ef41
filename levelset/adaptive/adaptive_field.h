#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

namespace levelset {

struct AdaptiveTree;  // defined in levelset/adaptive/octree/adaptive_tree.h, for the .cpp files

/// A solid as a signed distance field on an octree [Frisken00, Sigg06]. Cells are small where the
/// distance is far from its interpolant. Values are `float` in world units, negative inside. The
/// field is interpolated trilinearly in each leaf, or tricubically from values and gradients. It is
/// continuous: a corner of a leaf that lies on the face or edge of a larger leaf has the
/// interpolated figures of that leaf.
///
/// The class has value semantics. Copies share one tree, which does not change.
class AdaptiveField {
 public:
  AdaptiveField() = default;
  explicit AdaptiveField(std::shared_ptr<const AdaptiveTree> tree) : tree_(std::move(tree)) {}

  [[nodiscard]] bool isEmpty() const { return !tree_; }
  /// Largest error that was asked for, world units.
  [[nodiscard]] double tolerance() const;
  /// Distance from the surface up to which the tolerance holds in box(), world units. Farther away
  /// the values are coarse.
  [[nodiscard]] double halfWidth() const;
  /// Cube that the root covers, world units. Beyond it the distance to the cube is added.
  [[nodiscard]] Imath::Box3d box() const;
  /// Returns true for tricubic interpolation.
  [[nodiscard]] bool isTricubic() const;
  [[nodiscard]] std::size_t leafCount() const;
  [[nodiscard]] std::size_t memoryUse() const;  ///< bytes
  /// Bounds of the zero set, world units: where it crosses the edges of leaves, by linear
  /// interpolation. Empty when it crosses none.
  [[nodiscard]] Imath::Box3d zeroSetBounds() const;
  /// Hash of tree and values.
  [[nodiscard]] std::uint64_t contentHash() const;

  /// Tree behind the field, for the .cpp files of this library. Not null unless isEmpty().
  [[nodiscard]] const std::shared_ptr<const AdaptiveTree>& shared() const { return tree_; }

 private:
  std::shared_ptr<const AdaptiveTree> tree_;
};

/// Samples an adaptive field at world positions. Caches searches. Cheap to construct; use one per
/// thread.
class AdaptiveSampler {
 public:
  /// @pre the field is not empty
  explicit AdaptiveSampler(const AdaptiveField& field);
  ~AdaptiveSampler();
  AdaptiveSampler(AdaptiveSampler&&) noexcept;
  AdaptiveSampler& operator=(AdaptiveSampler&&) noexcept;

  /// Interpolated value. NaN for a position that is not finite.
  [[nodiscard]] double value(const Imath::V3d& world) const;
  /// Gradient of the interpolant in the leaf of the position. It jumps between leaves. Beyond the
  /// root, that of the nearest position in it. NaN for a position that is not finite.
  [[nodiscard]] Imath::V3d gradient(const Imath::V3d& world) const;
  /// Half of the diagonal of the leaf of a position, world units; beyond the root, that of the
  /// nearest position in it.
  [[nodiscard]] double leafRadius(const Imath::V3d& world) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace levelset
