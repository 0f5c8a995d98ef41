#pragma once

#include <Imath/ImathColor.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/scene/scene.h"

namespace render {

/// A function of the signed distances to the solids of a scene; renderers draw its zero set. It is
/// soft CSG by the smooth minimum of degree two [Quilez13],
///   smin(a, b) = min(a, b) − max(K − |a − b|, 0)² / 4K,  smax(a, b) = −smin(−a, −b),
/// or the morph (1 − s) a + s b between two solids. The distance to a solid is the trilinear
/// interpolant on the solid's own grid. Outside the solid's band it is ± the background, the half
/// width.
struct FieldExpression {
  enum class Join { Union, Intersection, Difference, Morph };
  /// One operation on the values numbered a and b. The numbers first count the operands, then the
  /// results of earlier steps.
  struct Step {
    Join join;
    std::size_t a, b;
  };
  struct Operand {
    std::size_t solid = 0;  ///< index in Scene::solids
    std::uint32_t id = 0;
    Imath::C3f colour{0};
    double background = 0;  ///< |φ| outside the band, world units
  };
  std::vector<Operand> operands;  ///< solids that the expression reads; empty solids are left out
  std::vector<Step> steps;
  std::size_t drawn = 0;  ///< number, as in Step, of the value whose zero set is drawn
  double softness = 0;    ///< K of the smooth minimum, world units
  double share = 0;       ///< s, fraction of the morph, [0, 1]

  /// True when the expression reads no solid, so that nothing is drawn.
  [[nodiscard]] bool isEmpty() const { return operands.empty(); }
  /// Joins the values a and b of two operands. The result is monotone: nondecreasing in a and b,
  /// but nonincreasing in b for a difference.
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

/// Builds the expression of a blended scene. @pre the scene passes requireFields()
[[nodiscard]] FieldExpression fieldExpression(const Scene& scene);

/// Checks the softness and the morph of a scene; accepts a scene that has neither.
/// @throws levelset::UsageError for a softness below 0 or without an expression, and for
///         transparent solids that are blended. Also for a morph outside [0, 1], combined with an
///         expression, or of a number of solids other than two.
/// @throws levelset::InvalidInput for a softness that is too large for the half widths of the
/// bands, and for a morph of an empty solid
void requireFields(const Scene& scene);

}  // namespace render
