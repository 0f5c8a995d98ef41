#pragma once

// Private to solids of molecules: unions of balls and rods.

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "levelset/molecules/ball_union.h"
#include "levelset/progress.h"

namespace levelset {

/// A cylinder around the line between the centres of two balls.
struct Rod {
  std::uint32_t first = 0, second = 0;  ///< indices of the balls, at different places
  double radius = 0;                    ///< positive, at most the radii of both balls
};

/// The union of balls and rods between them.
///
/// Outside, the distance is that from the nearest surface. Inside, the closest point of the
/// boundary lies on the surface of the ball or rod in which the point is deepest, unless another
/// one covers it. Then it lies on a curve where two surfaces meet. Each curve is a function of the
/// angle around a rod or a ball. Samples of its exposed part find the minima, and a search between
/// them the closest point, to 1e-9 of the radius. Exposed parts shorter than a fifth of a radius
/// may be missed; distances inside, beside them, are too large. Nearly parallel rods whose sides
/// overlap are refused.
class RodUnion {
 public:
  /// @param balls  finite centres, positive finite radii; at least one
  /// @throws InvalidInput for other balls or rods, and for rods that lie side by side and overlap;
  ///         ResourceLimit, Cancelled
  RodUnion(const std::vector<Ball>& balls, const std::vector<Rod>& rods,
           std::size_t maxBytes = kNoMemoryLimit, const Progress& progress = {});

  /// Signed distance from the boundary, negative inside.
  /// @param depth  deeper distances may be lower bounds of the depth above it
  [[nodiscard]] double distance(const Imath::V3d& point, double depth) const;
  [[nodiscard]] Imath::Box3d bounds() const;
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

}  // namespace levelset
