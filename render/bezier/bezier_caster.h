#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "levelset/progress.h"
#include "render/bezier/shared_tree.h"

namespace render {

struct RayGroup;  // private to the ray casters

/// A Bézier volume prepared for rays of any direction, as shadow rays, which share no view. Patches
/// are split once into small parts, and a tree of boxes finds those that a ray meets. Each part is
/// then viewed along the ray. The rays of a camera are faster in a SharedTree.
///
/// The class has value semantics. Copies share the data. All methods may run concurrently.
class BezierCaster {
 public:
  /// @throws levelset::InvalidInput as requireBezierVolume()
  /// @throws levelset::ResourceLimit if the parts exceed `maxBytes`
  explicit BezierCaster(BezierVolume volume, std::size_t maxBytes = levelset::kNoMemoryLimit);

  [[nodiscard]] const BezierVolume& volume() const;
  /// Box of the parts that may have a piece of the surface, world units; empty without any. Parts
  /// have at most a twelfth of the diagonal of the volume, or are of the sixth level.
  [[nodiscard]] const Imath::Box3d& bounds() const;
  /// Upper bounds of p·direction over the points p of the surface, world units; −∞ without parts.
  [[nodiscard]] std::vector<double> extents(const std::vector<Imath::V3d>& directions) const;
  /// Number of the parts.
  [[nodiscard]] std::size_t partCount() const;
  /// Memory of the parts and of the volume, bytes.
  [[nodiscard]] std::size_t bytes() const;

  /// Reason why the volume is no solid that an expression may combine; empty: none is known. The
  /// first call computes it, from samples (findOpenPatch(), findFoldedPatch()).
  [[nodiscard]] const std::string& refusalAsSolid() const;

  /// First intersection of a ray between its ends.
  [[nodiscard]] std::optional<BezierRoot> firstHit(const Camera::Ray& ray) const;
  /// Returns true if a ray intersects the surface between its ends. Cheaper than firstHit().
  [[nodiscard]] bool isOccluded(const Camera::Ray& ray) const;
  /// All intersections of a ray between its ends, in order of their distance.
  [[nodiscard]] std::vector<BezierRoot> roots(const Camera::Ray& ray) const;

 private:
  struct Data;
  enum class Wanted { Any, Nearest, All };
  /// Adds the roots of the only ray of a group.
  void cast(const Camera::Ray& ray, Wanted wanted, RayGroup& group) const;
  [[nodiscard]] std::optional<BezierRoot> nearest(const Camera::Ray& ray, Wanted wanted) const;
  std::shared_ptr<const Data> data_;
};

}  // namespace render
