#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/scene/csg_expression.h"

namespace render {

/// Follows rays through solids, each to the first place where it enters or leaves what an
/// expression makes of them, or without an expression any of them, and on to others. Asks for a
/// ray's first crossing with each solid, and for others as it comes to them.
///
/// Surfaces met at one and the same place are crossed together, and the lowest of their numbers is
/// the one that is met.
class CsgTraversal {
 public:
  /// What a ray waits for: its crossing with the solid after `passing` others.
  struct Query {
    std::size_t ray;
    std::int32_t passing;
  };

  /// @param solids  how many the expression counts
  /// @param maxDistance   of each ray: what lies beyond does not count
  CsgTraversal(const CsgExpression& csg, std::size_t solids, std::vector<double> maxDistances);

  /// Those about a solid, which are to be answered before the next advance().
  [[nodiscard]] std::vector<Query> queriesFor(std::size_t solid) const;
  void answer(std::size_t solid, const Query& query, double place, bool enters);
  void answerNone(std::size_t solid, const Query& query);
  /// Goes on along every ray as far as the answers tell. @return is there anything to ask?
  bool advance();

  /// Lets a ray that met something go on to what it meets next.
  void resume(std::size_t ray) { met_[ray] = -1; }

  /// Number of the solid that the ray meets, or −1.
  [[nodiscard]] std::int32_t solidMet(std::size_t ray) const { return met_[ray]; }
  /// Is the outside of that solid inside what the expression makes?
  [[nodiscard]] bool isFlipped(std::size_t ray) const { return flipped_[ray] != 0; }

 private:
  bool advance(std::size_t ray);
  void cross(std::size_t ray, double place);

  const CsgExpression& csg_;
  std::size_t solids_;
  std::vector<double> maxDistances_;
  // By ray and solid.
  std::vector<double> place_;  // of the next crossing
  std::vector<std::int32_t> passed_;
  std::vector<char> inside_, asked_;
  // By ray.
  std::vector<std::int32_t> met_;
  std::vector<char> flipped_;
};

}  // namespace render
