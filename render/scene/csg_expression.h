#pragma once

#include <Imath/ImathBox.h>

#include <cstddef>
#include <string>
#include <vector>

namespace render {

/// A CSG expression over named solids, evaluated for a single point: `a | b` is the union, `a & b`
/// the intersection, `a - b` the difference. As in Python, `-` binds closest, then `&`, then `|`;
/// parentheses are allowed.
class CsgExpression {
 public:
  CsgExpression() = default;
  /// @param names  names of the solids, in their order: letters, digits and _, no digit first
  /// @throws levelset::UsageError for a text that is not a CSG expression or uses an unknown name
  CsgExpression(const std::string& text, const std::vector<std::string>& names);

  [[nodiscard]] bool isEmpty() const { return steps_.empty(); }
  [[nodiscard]] const std::string& text() const { return text_; }
  /// True when the result of the expression contains a point. @param inside  for each solid:
  /// nonzero when the solid contains the point
  [[nodiscard]] bool holds(const char* inside) const;
  /// Combines the signed distances of a point to all solids by minima and maxima. The combined
  /// value has the sign of the signed distance to the result's surface, and its magnitude is at
  /// most that of the distance.
  [[nodiscard]] double phi(const double* phi) const;
  [[nodiscard]] bool uses(std::size_t solid) const;
  /// Box that contains the result of the expression, given boxes of the solids, all in world units.
  /// @param growth  distance by which a union may extend beyond its operands, world units
  [[nodiscard]] Imath::Box3d bounds(const std::vector<Imath::Box3d>& boxes,
                                    double growth = 0) const;
  /// Copy of the expression in which the solids have the given numbers.
  /// @param numbers  new number of each solid; negative: the solid is empty
  [[nodiscard]] CsgExpression renumbered(const std::vector<int>& numbers) const;

  enum Step : int { Union = -1, Intersection = -2, Difference = -3, Nothing = -4 };
  /// The expression in postfix notation. An entry ≥ 0 is the number of a solid, a negative entry is
  /// a Step. Nothing stands for an empty solid.
  [[nodiscard]] const std::vector<int>& postfix() const { return steps_; }

 private:
  friend class CsgParser;
  std::vector<int> steps_;
  std::string text_;
};

}  // namespace render
