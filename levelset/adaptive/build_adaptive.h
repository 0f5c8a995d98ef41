#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>

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
  /// Returns the distance of a position, negative inside. Called from several threads at once.
  [[nodiscard]] virtual double at(const Imath::V3d& position, const Known& known) const = 0;
};

struct AdaptiveOptions {
  /// Largest error of the field, world units.
  double tolerance = 0;
  /// Distance from the surface up to which the tolerance holds, world units; 0: 2 % of the diagonal
  /// of the box. Kinks of the distance half way between two parts of the surface need many small
  /// cells.
  double halfWidth = 0;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// Figures of buildAdaptive().
struct AdaptiveReport {
  std::size_t evaluations = 0;  ///< of the distance
  /// Largest error at the points where leaves were tested, world units: their centres and the
  /// middles of their faces and edges. Errors between these points are at most about twice as
  /// large.
  double testedError = 0;
};

/// Samples a signed distance on an octree. Splits a leaf while its interpolant is off by more than
/// half of the tolerance at its centre, or in the middle of a face or edge. The smallest cells have
/// an edge of at most the tolerance; a distance cannot be off by more in them.
/// @param box  bounds of the surface, world units; the root is a cube around it
/// @throws UsageError for a tolerance that is not positive, or below the side of the root by
///         2^−kMaxOctreeDepth
/// @throws InvalidInput for an empty or infinite box, and if the spacing of representable
///         coordinates exceeds an eighth of the tolerance
/// @throws ResourceLimit, Cancelled
[[nodiscard]] AdaptiveField buildAdaptive(const SignedDistance& distance, const Imath::Box3d& box,
                                          const AdaptiveOptions& options,
                                          AdaptiveReport* report = nullptr);

}  // namespace levelset
