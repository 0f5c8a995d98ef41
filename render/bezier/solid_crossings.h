#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "render/bezier/shared_tree.h"

namespace render {

/// Points where a ray enters and leaves the solid of a Bézier volume.
struct SolidCrossings {
  /// In order of their distance. Entries and exits alternate: BezierRoot::isEntry.
  std::vector<BezierRoot> roots;
  /// True if the roots show that the surface is open: the ray enters and does not leave, or leaves
  /// where it has not entered. Such roots are left out.
  bool isOpen = false;
};

/// Joins the roots of a ray to the intervals in which it is inside. Patches may overlap: a point is
/// inside if one of them contains it. No map may fold inside the solid, since the roots do not show
/// where the layers of a fold end.
///
/// The ray ends outside, so layers are counted from its end. A singular root is a touching point,
/// or an entry or exit where the map is singular. It counts as the latter only where its neighbours
/// need it.
/// @param roots  all roots from the begin of the ray to infinity, in order of their distance
/// @param startsOutside  true: the ray is known to begin outside the solid
[[nodiscard]] SolidCrossings solidCrossings(std::span<const BezierRoot> roots, bool startsOutside);

/// Returns the number of the first patch with a face through which the inside leaves the volume:
/// the face belongs to one patch alone, it has an area, and a part of it is inside. Without such a
/// face the surface is closed, and it returns the number of patches. Surfaces without attributes
/// are open.
[[nodiscard]] std::size_t findOpenPatch(const BezierVolume& volume);

/// Returns the number of the first patch whose map folds inside the object, or the number of
/// patches without one: samples of the inside have Jacobians of both signs.
[[nodiscard]] std::size_t findFoldedPatch(const BezierVolume& volume);

}  // namespace render
