#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <functional>

#include "levelset/adaptive/adaptive_field.h"
#include "levelset/progress.h"

namespace levelset {

/// Signed distance that can be evaluated everywhere.
class SignedDistance {
 public:
  SignedDistance() = default;
  SignedDistance(const SignedDistance&) = delete;
  SignedDistance& operator=(const SignedDistance&) = delete;
  virtual ~SignedDistance() = default;

  /// Value at another position, for faster searches.
  struct Known {
    double value = 0;   ///< world units
    double apart = -1;  ///< distance between the positions, world units; negative: no value
  };
  /// Returns the distance of a position, negative inside. `known` does not change the result.
  /// Called from several threads at once.
  [[nodiscard]] virtual double at(const Imath::V3d& position, const Known& known) const = 0;
  /// Returns the gradient at a position with a value. At a kink, that of one side. By default from
  /// central differences over two steps.
  /// @param step  world units; small beside the cell that has the position as a corner
  [[nodiscard]] virtual Imath::V3d gradient(const Imath::V3d& position, double value,
                                            double step) const;
  /// Receives a point and its distance. Returns false to end a visit.
  using Visit = std::function<bool(const Imath::V3d& point, double value)>;
  /// Visits points on or near the surface in a box, where it may leave its course between the
  /// points of a lattice. Without them, a large cell can miss a part that is small beside it. None
  /// by default.
  virtual void visitSurface(const Imath::Box3d& /*box*/, const Visit& /*visit*/) const {}
};

struct AdaptiveOptions {
  /// Largest error of the field, world units.
  double tolerance = 0;
  /// Distance from the surface up to which the tolerance holds, world units, finite; 0: 2 % of the
  /// diagonal of the box. Kinks of the distance half way between two parts of the surface need many
  /// small cells.
  double halfWidth = 0;
  /// Interpolates from gradients too. Smooth surfaces need far fewer cells, each with four times
  /// the numbers.
  bool isTricubic = false;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Figures of buildAdaptive().
struct AdaptiveReport {
  std::size_t evaluations = 0;  ///< number of calls of SignedDistance::at()
  /// Largest error of the leaves at the points where they were tested, before their corners took
  /// over values of larger leaves, world units.
  double testedError = 0;
  /// Largest change of a leaf by corners that took over figures of larger leaves, world units.
  double hangingError = 0;
};

/// Samples a signed distance on an octree. Divides a leaf within the half width while its
/// interpolant is off by more than half of the tolerance (0.45 of it if tricubic): at its centre,
/// in the middle of a face or an edge, or at a visited point of the surface. Divides a leaf too
/// that would change a smaller one by more than that at a corner. The error at these points is then
/// at most the tolerance; elsewhere this is an experience. The smallest cells have an edge of at
/// most half of the tolerance.
/// @param box  bounds of the surface, world units; the root is a cube around it
/// @throws UsageError for a tolerance that is not positive, or below the side of the root times
///         2^(1 − kMaxOctreeDepth), and for a half width that is negative or infinite
/// @throws InvalidInput for an empty or infinite box, and if the spacing of representable
///         coordinates exceeds an eighth of the tolerance
/// @throws ResourceLimit, Cancelled
[[nodiscard]] AdaptiveField buildAdaptive(const SignedDistance& distance, const Imath::Box3d& box,
                                          const AdaptiveOptions& options,
                                          AdaptiveReport* report = nullptr);

}  // namespace levelset
