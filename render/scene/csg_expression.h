#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <string>
#include <vector>

namespace render {

/// A CSG expression over named solids, evaluated point by point: `a | b` is the union, `a & b` the
/// intersection, `a - b` the difference. As in Python, `-` binds closest, then `&`, then `|`;
/// parentheses are allowed.
class CsgExpression {
 public:
  CsgExpression() = default;
  /// @param names  names of the solids, in their order: letters, digits and _, no digit first
  /// @throws levelset::UsageError for a text that is not such an expression or uses an unknown name
  CsgExpression(const std::string& text, const std::vector<std::string>& names);

  [[nodiscard]] bool isEmpty() const { return steps_.empty(); }
  [[nodiscard]] const std::string& text() const { return text_; }
  /// True when the result contains a point. @param inside  by solid: nonzero when it contains the
  /// point
  [[nodiscard]] bool holds(const char* inside) const;
  /// Combines signed distances to the solids, given by solid. The result has the sign of the
  /// distance to the result's surface, and its magnitude is never larger.
  [[nodiscard]] double phi(const double* phi) const;
  [[nodiscard]] bool uses(std::size_t solid) const;
  /// A box that contains the result, given boxes that contain the solids.
  /// @param growth  distance by which a union may extend beyond its operands, world units
  [[nodiscard]] Imath::Box3d bounds(const std::vector<Imath::Box3d>& boxes,
                                    double growth = 0) const;
  /// The same expression with other numbers of the solids.
  /// @param numbers  new number of each solid; negative: the solid is empty
  [[nodiscard]] CsgExpression renumbered(const std::vector<int>& numbers) const;

  enum Step : int { Union = -1, Intersection = -2, Difference = -3, Nothing = -4 };
  /// The expression in postfix notation. Entries are numbers of solids, or a Step.
  [[nodiscard]] const std::vector<int>& postfix() const { return steps_; }

 private:
  friend class CsgParser;
  std::vector<int> steps_;
  std::string text_;
};

}  // namespace render
