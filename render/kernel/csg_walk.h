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
class CsgWalk {
 public:
  /// What a ray waits for: its crossing with the solid after `passing` others.
  struct Question {
    std::size_t ray;
    std::int32_t passing;
  };

  /// @param solids  how many the expression counts
  /// @param reach   of each ray: what lies beyond does not count
  CsgWalk(const CsgExpression& csg, std::size_t solids, std::vector<double> reach);

  /// Those about a solid, which are to be answered before the next advance().
  [[nodiscard]] std::vector<Question> questionsAbout(std::size_t solid) const;
  void answer(std::size_t solid, const Question& question, double place, bool goesIn);
  void answerNone(std::size_t solid, const Question& question);
  /// Goes on along every ray as far as the answers tell. @return is there anything to ask?
  bool advance();

  /// Lets a ray that met something go on to what it meets next.
  void goOn(std::size_t ray) { met_[ray] = -1; }

  /// Number of the solid that the ray meets, or −1.
  [[nodiscard]] std::int32_t solidMet(std::size_t ray) const { return met_[ray]; }
  /// Is the outside of that solid inside what the expression makes?
  [[nodiscard]] bool isTurned(std::size_t ray) const { return turned_[ray] != 0; }

 private:
  bool advance(std::size_t ray);
  void cross(std::size_t ray, double place);

  const CsgExpression& csg_;
  std::size_t solids_;
  std::vector<double> reach_;
  // By ray and solid.
  std::vector<double> place_;  // of the next crossing
  std::vector<std::int32_t> passed_;
  std::vector<char> inside_, asked_;
  // By ray.
  std::vector<std::int32_t> met_;
  std::vector<char> turned_;
};

}  // namespace render
