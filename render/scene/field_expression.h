#pragma once

#include <Imath/ImathColor.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/scene/scene.h"

namespace render {

/// A function of the distances to solids whose zero set is drawn: soft CSG by the smooth minimum of
/// degree two [Quilez13],
///   smin(a, b) = min(a, b) − max(K − |a − b|, 0)² / 4K,  smax(a, b) = −smin(−a, −b),
/// or (1 − s) a + s b on the way from one solid to another. Distances are the trilinear
/// interpolants of the grids, each on its own, ± the background where a band does not reach.
struct FieldExpression {
  enum class Join { Union, Intersection, Difference, Morph };
  /// Operands are numbered: the solids first, then the results of the steps.
  struct Step {
    Join join;
    std::size_t a, b;
  };
  struct Operand {
    std::size_t solid = 0;  ///< index in Scene::solids
    std::uint32_t id = 0;
    Imath::C3f colour{0};
    double background = 0;  ///< world units
  };
  std::vector<Operand> operands;  ///< solids with a band
  std::vector<Step> steps;
  std::size_t drawn = 0;  ///< whose zero set is: number of a value
  double softness = 0;    ///< K, world units
  double share = 0;       ///< s

  /// Nothing is drawn.
  [[nodiscard]] bool isEmpty() const { return operands.empty(); }
  /// Of two values; not smaller where a is larger, or b, but for a difference, where b is smaller.
  [[nodiscard]] double join(Join how, double a, double b) const {
    switch (how) {
      case Join::Union:
        return smoothMin(a, b);
      case Join::Intersection:
        return -smoothMin(-a, -b);
      case Join::Difference:
        return -smoothMin(-a, b);
      default:
        return (1 - share) * a + share * b;
    }
  }
  [[nodiscard]] std::size_t valueCount() const { return operands.size() + steps.size(); }

 private:
  [[nodiscard]] double smoothMin(double a, double b) const {
    const double overlap = std::max(softness - std::abs(a - b), 0.0);
    return std::min(a, b) - overlap * overlap / (4 * softness);
  }
};

/// Of a scene that is blended. @pre requireFields(scene)
[[nodiscard]] FieldExpression fieldExpression(const Scene& scene);

/// Of any scene.
/// @throws levelset::UsageError for a softness without an expression or below 0, a morph beyond
///         [0, 1], beside an expression or of other than two solids, and solids of an opacity that
///         are blended; levelset::InvalidInput for a softness beyond what the bands know, and a
///         morph of nothing
void requireFields(const Scene& scene);

}  // namespace render
