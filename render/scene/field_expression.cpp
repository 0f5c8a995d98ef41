#include "render/scene/field_expression.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "levelset/error.h"

namespace render {
namespace {

using Join = FieldExpression::Join;

double backgroundOf(const Solid& solid) {
  return solid.band.halfWidth() * solid.band.voxelSize();
}

/// True when the expression or the morph reads the field of a solid.
bool isOperand(const Scene& scene, std::size_t solid) {
  return !scene.solids[solid].band.isEmpty() && (scene.morph || scene.csg.uses(solid));
}

Join joinOf(int step) {
  switch (step) {
    case CsgExpression::Union:
      return Join::Union;
    case CsgExpression::Intersection:
      return Join::Intersection;
    default:
      return Join::Difference;
  }
}

/// Converts the postfix notation of a CsgExpression into steps. Operations with an empty solid are
/// replaced by their result.
class StepWriter {
 public:
  explicit StepWriter(FieldExpression& to) : to_(to) {}

  void push(std::optional<std::size_t> value) { stack_.push_back(value); }
  void join(Join join) {
    const std::optional<std::size_t> b = stack_.back();
    stack_.pop_back();
    std::optional<std::size_t>& a = stack_.back();
    if (a && b) {
      to_.steps.push_back({join, *a, *b});
      a = to_.valueCount() - 1;
    } else if (join == Join::Intersection) {
      a.reset();
    } else if (join == Join::Union && !a) {
      a = b;
    }
  }
  [[nodiscard]] std::optional<std::size_t> result() const { return stack_.back(); }

 private:
  FieldExpression& to_;
  std::vector<std::optional<std::size_t>> stack_;
};

/// Largest number of nested steps of the expression between an operand and the drawn value.
int depthOf(const FieldExpression& expression) {
  std::vector<int> depth(expression.operands.size(), 0);
  for (const FieldExpression::Step& step : expression.steps)
    depth.push_back(std::max(depth[step.a], depth[step.b]) + 1);
  return depth.empty() ? 0 : depth[expression.drawn];
}

void requireMorph(const Scene& scene) {
  if (!scene.csg.isEmpty() || scene.softness > 0)
    throw levelset::UsageError(
        "scene: a morph blends two solids and cannot be combined with an expression or a softness; "
        "leave one of them out");
  if (!(*scene.morph >= 0 && *scene.morph <= 1))
    throw levelset::UsageError(fmt::format(
        "scene: a morph of {} is out of range; give a number from 0 to 1", *scene.morph));
  if (scene.solids.size() != 2)
    throw levelset::UsageError(fmt::format(
        "scene: a morph needs exactly two solids, but the scene has {}; add or remove solids",
        scene.solids.size()));
  for (const Solid& solid : scene.solids)
    if (solid.band.isEmpty())
      throw levelset::InvalidInput(
          fmt::format("scene: '{}' is empty and cannot be morphed; give two solids with a surface",
                      solid.name));
}

void requireSoftness(const Scene& scene) {
  if (!(scene.softness >= 0 && std::isfinite(scene.softness)))
    throw levelset::UsageError(fmt::format(
        "scene: a softness of {} is out of range; give a length of 0 or more", scene.softness));
  if (!(scene.softness > 0)) return;
  if (scene.csg.isEmpty())
    throw levelset::UsageError("scene: softness needs an expression; give one, such as 'a | b'");
  const FieldExpression expression = fieldExpression(scene);
  double narrowest = std::numeric_limits<double>::infinity();
  for (const FieldExpression::Operand& operand : expression.operands)
    narrowest = std::min(narrowest, operand.background);
  // Each step of the smooth minimum changes the value by up to K/4. Far from all solids each
  // operand is the background (the half width), and the value after all steps must still be
  // positive.
  const int depth = depthOf(expression);
  const double most = narrowest * std::min(1.0, 3.999 / std::max(depth, 1));
  if (scene.softness <= most) return;
  throw levelset::InvalidInput(
      fmt::format("scene: a softness of {:.6g} is too large for the bands, which store distances "
                  "up to {:.6g}{}; widen them with rebuild-band, or give at most {:.6g}",
                  scene.softness, narrowest,
                  depth > 4 ? fmt::format(" and are joined in {} nested steps", depth) : "", most));
}

}  // namespace

FieldExpression fieldExpression(const Scene& scene) {
  FieldExpression result;
  result.softness = scene.softness;
  std::vector<std::optional<std::size_t>> number(scene.solids.size());
  for (std::size_t i = 0; i < scene.solids.size(); ++i) {
    if (!isOperand(scene, i)) continue;
    const Solid& solid = scene.solids[i];
    number[i] = result.operands.size();
    result.operands.push_back({i, solid.id, solid.colour, backgroundOf(solid)});
  }
  if (scene.morph) {
    result.share = *scene.morph;
    result.steps.push_back({Join::Morph, 0, 1});
    result.drawn = 2;
    return result;
  }
  StepWriter writer(result);
  for (const int step : scene.csg.postfix()) {
    if (step == CsgExpression::Nothing)
      writer.push(std::nullopt);
    else if (step >= 0)
      writer.push(number[static_cast<std::size_t>(step)]);
    else
      writer.join(joinOf(step));
  }
  if (!writer.result()) return {};
  result.drawn = *writer.result();
  return result;
}

void requireFields(const Scene& scene) {
  if (scene.morph) requireMorph(scene);
  requireSoftness(scene);
  if (!scene.isBlended()) return;
  for (const Solid& solid : scene.solids)
    if (solid.opacity != 1)
      throw levelset::UsageError(fmt::format(
          "scene: an opacity of {} for '{}' is not supported: soft expressions and morphs have one "
          "surface, blended from all solids; omit the opacity",
          solid.opacity, solid.name));
}

}  // namespace render
