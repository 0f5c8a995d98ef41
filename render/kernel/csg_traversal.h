#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/scene/csg_expression.h"

namespace render {

/// Follows rays through solids, from one surface of the result of a CSG expression to the next.
/// Without an expression, it stops at each surface of each solid.
///
/// The caller computes the intersections. The traversal requests the first crossing of a ray with
/// each solid, and later crossings when it needs them. Surfaces at equal distance are crossed
/// together; the hit is attributed to the solid with the lowest number.
class CsgTraversal {
 public:
  /// Request for the next crossing of a ray with a solid. The first `passing` crossings of the ray
  /// with that solid are skipped.
  struct Query {
    std::size_t ray;
    std::int32_t passing;
  };

  /// @param solids  number of solids of the expression
  /// @param maxDistances  largest `place` of a crossing for each ray; crossings beyond it do not
  /// count
  CsgTraversal(const CsgExpression& csg, std::size_t solids, std::vector<double> maxDistances);

  /// Open queries about the solid with this number. Each must be answered by answer() or
  /// answerNone() before the next advance(). `place` is the position of the crossing along the ray,
  /// a depth or a distance, in the unit of maxDistances.
  [[nodiscard]] std::vector<Query> queriesFor(std::size_t solid) const;
  void answer(std::size_t solid, const Query& query, double place, bool enters);
  void answerNone(std::size_t solid, const Query& query);
  /// Moves each ray to its next hit, or up to the point where it needs another crossing.
  /// @return true when there are open queries
  bool advance();

  /// Lets a ray continue behind its present hit: the next advance() moves it to its next hit.
  void resume(std::size_t ray) { met_[ray] = -1; }

  /// Number of the solid at the present hit of the ray; −1 without a hit.
  [[nodiscard]] std::int32_t solidMet(std::size_t ray) const { return met_[ray]; }
  /// True when the result of the expression is on the outside of the hit solid, as for a subtracted
  /// solid.
  [[nodiscard]] bool isFlipped(std::size_t ray) const { return flipped_[ray] != 0; }

 private:
  bool advance(std::size_t ray);
  void cross(std::size_t ray, double place);

  const CsgExpression& csg_;
  std::size_t solids_;
  std::vector<double> maxDistances_;
  // Indexed by ray and solid.
  std::vector<double> place_;  // position of the ray's next crossing with the solid; infinite: none
  std::vector<std::int32_t> passed_;  // number of crossings behind the ray's present position
  // inside_: 1 when the ray is inside the solid. asked_: 1 when its query about the solid is open.
  std::vector<char> inside_, asked_;
  // Indexed by ray.
  std::vector<std::int32_t> met_;  // number of the hit solid; −1: no hit
  std::vector<char> flipped_;
};

}  // namespace render
