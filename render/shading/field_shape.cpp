#include "render/shading/field_shape.h"

#include <algorithm>
#include <cmath>

#include "render/shading/principal_direction.h"

namespace render {
namespace {

using Imath::M33d;
using Imath::V3d;
using Join = FieldExpression::Join;

// Fraction of the background, which is |φ| outside the band: at values of larger magnitude the band
// stores no distance.
constexpr double kAtEnd = 1 - 1e-6;
// Difference, as a fraction of 1, up to which the contributions of two solids to a point count as
// equal; then the id of the first solid is used.
constexpr double kEqualParts = 1e-6;

/// Result of a step of the expression: `value`, first derivatives `a` and `b` by the operands of
/// the same names, and a second derivative. `signOfB` is −1 for a difference, which joins −b, else
/// 1.
struct JoinShape {
  double value, a, b;
  double signOfB;
  double bend;  ///< second derivative of the value along a − signOfB · b
};

JoinShape joined(const FieldExpression& e, Join join, double a, double b) {
  const double value = e.join(join, a, b);
  if (join == Join::Morph) return {value, 1 - e.share, e.share, 1, 0};
  const double signOfB = join == Join::Difference ? -1 : 1, turn = join == Join::Union ? 1 : -1;
  const double ahead = turn * (signOfB * b - a);
  const double share = std::clamp(0.5 + 0.5 * ahead / e.softness, 0.0, 1.0);
  const double bend = std::abs(ahead) < e.softness ? -0.5 * turn / e.softness : 0;
  return {value, share, signOfB * (1 - share), signOfB, bend};
}

M33d outer(const V3d& v) {
  return {v.x * v.x, v.x * v.y, v.x * v.z, v.x * v.y, v.y * v.y,
          v.y * v.z, v.x * v.z, v.y * v.z, v.z * v.z};
}

FieldShape joinedShape(const JoinShape& step, const FieldShape& a, const FieldShape& b) {
  FieldShape result;
  result.value = step.value;
  SurfaceShape& s = result.shape;
  s.gradient = a.shape.gradient * step.a + b.shape.gradient * step.b;
  s.trilinearGradient = a.shape.trilinearGradient * step.a + b.shape.trilinearGradient * step.b;
  s.hessian = a.shape.hessian * step.a + b.shape.hessian * step.b +
              outer(a.shape.gradient - b.shape.gradient * step.signOfB) * step.bend;
  s.interpolationError =
      std::abs(step.a) * a.shape.interpolationError + std::abs(step.b) * b.shape.interpolationError;
  return result;
}

}  // namespace

FieldShape fieldShape(double value, const SurfaceShape& shape, const Imath::M44d& indexToWorld) {
  const M33d axes(indexToWorld[0][0], indexToWorld[0][1], indexToWorld[0][2],  //
                  indexToWorld[1][0], indexToWorld[1][1], indexToWorld[1][2],  //
                  indexToWorld[2][0], indexToWorld[2][1], indexToWorld[2][2]);
  const double squared = V3d(axes[0][0], axes[0][1], axes[0][2]).length2();
  FieldShape result{value, shape};
  result.shape.gradient = shape.gradient * axes / squared;
  result.shape.trilinearGradient = shape.trilinearGradient * axes / squared;
  result.shape.hessian = axes.transposed() * shape.hessian * axes * (1 / (squared * squared));
  return result;
}

void addFieldShape(Hit& hit, const FieldExpression& expression,
                   const std::vector<FieldShape>& operands, const V3d& direction) {
  std::vector<FieldShape> values = operands;
  std::vector<JoinShape> steps;
  for (const FieldExpression::Step& step : expression.steps) {
    steps.push_back(joined(expression, step.join, values[step.a].value, values[step.b].value));
    values.push_back(joinedShape(steps.back(), values[step.a], values[step.b]));
  }
  std::vector<double> parts(values.size(), 0);
  parts[expression.drawn] = 1;
  for (std::size_t n = steps.size(); n-- > 0;) {
    const double part = parts[operands.size() + n];
    parts[expression.steps[n].a] += part * std::abs(steps[n].a);
    parts[expression.steps[n].b] += part * std::abs(steps[n].b);
  }
  hit.found = true;
  hit.colour = Imath::C3f(0);
  std::size_t largest = 0;
  for (std::size_t i = 0; i < operands.size(); ++i) {
    const FieldExpression::Operand& operand = expression.operands[i];
    hit.colour += operand.colour * static_cast<float>(parts[i]);
    if (parts[i] > parts[largest] + kEqualParts) largest = i;
    if (parts[i] > 0 && std::abs(operands[i].value) >= kAtEnd * operand.background)
      hit.isBeyondBand = true;
  }
  hit.id = expression.operands[largest].id;
  hit.solid = expression.operands[largest].solid;
  addShape(hit, values[expression.drawn].shape, Imath::M44d(), direction);
  addDirection(hit, values[expression.drawn].shape, Imath::M44d());
}

}  // namespace render
