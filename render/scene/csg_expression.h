#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <string>
#include <vector>

namespace render {

/// A solid made of others, point by point: `a | b` what is in either, `a & b` in both, `a - b` in a
/// alone, with parentheses. As in Python `-` binds closest, then `&`, then `|`.
class CsgExpression {
 public:
  CsgExpression() = default;
  /// @param names  of the solids, in their order: letters, digits and _, no digit first
  /// @throws levelset::UsageError for a text that is no such expression or names none of them
  CsgExpression(const std::string& text, const std::vector<std::string>& names);

  [[nodiscard]] bool isEmpty() const { return steps_.empty(); }
  [[nodiscard]] const std::string& text() const { return text_; }
  /// @param inside  by solid: not 0 where it holds the point
  [[nodiscard]] bool holds(const char* inside) const;
  /// Of signed distances to the solids, by solid, one that has the sign of what the expression
  /// makes and is nowhere larger in magnitude than the distance to it.
  [[nodiscard]] double phi(const double* phi) const;
  [[nodiscard]] bool uses(std::size_t solid) const;
  /// A box that holds what the expression makes of solids that lie in those boxes.
  /// @param growth  how far a union may reach beyond its operands, world units
  [[nodiscard]] Imath::Box3d bounds(const std::vector<Imath::Box3d>& boxes,
                                    double growth = 0) const;
  /// The same of solids by other numbers. @param numbers  by solid; negative: it holds nothing
  [[nodiscard]] CsgExpression renumbered(const std::vector<int>& numbers) const;

  enum Step : int { kUnion = -1, kIntersection = -2, kDifference = -3, kNothing = -4 };
  /// Operands before what joins them: a solid's number, or a Step.
  [[nodiscard]] const std::vector<int>& postfix() const { return steps_; }

 private:
  friend class CsgParser;
  std::vector<int> steps_;
  std::string text_;
};

}  // namespace render
