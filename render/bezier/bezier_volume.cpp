#include "render/bezier/bezier_volume.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "levelset/error.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::TensorBernstein;

// Products of four numbers of this magnitude are finite.
constexpr double kLargestCoordinate = 1e30;
// A ratio of weights that double precision resolves.
constexpr double kLeastWeight = 1e-6, kLargestWeight = 1e6, kLargestRatio = 1e6;

double weightAt(const BezierPatch& patch, std::size_t n) {
  return patch.weights.empty() ? 1 : patch.weights[n];
}

/// Homogeneous coordinates of the control points: w, w x, w y, w z, and w times each attribute.
std::vector<TensorBernstein> homogeneous(const BezierPatch& patch) {
  std::vector<TensorBernstein> result(4 + patch.attributes.size(), TensorBernstein(patch.degree));
  for (std::size_t n = 0; n < patch.points.size(); ++n) {
    const double w = weightAt(patch, n);
    result[0].coefficients[n] = w;
    for (int c = 0; c < 3; ++c)
      result[static_cast<std::size_t>(c + 1)].coefficients[n] = w * patch.points[n][c];
    for (std::size_t a = 0; a < patch.attributes.size(); ++a)
      result[4 + a].coefficients[n] = w * patch.attributes[a][n];
  }
  return result;
}

BezierPatch fromHomogeneous(const std::vector<TensorBernstein>& forms, bool isRational) {
  BezierPatch patch;
  patch.degree = forms[1].degree;
  patch.attributes.resize(forms.size() - 4);
  const std::size_t count = forms[1].coefficients.size();
  for (std::size_t n = 0; n < count; ++n) {
    const double w = isRational ? forms[0].coefficients[n] : 1;
    patch.points.emplace_back(forms[1].coefficients[n] / w, forms[2].coefficients[n] / w,
                              forms[3].coefficients[n] / w);
    for (std::size_t a = 0; a + 4 < forms.size(); ++a)
      patch.attributes[a].push_back(forms[4 + a].coefficients[n] / w);
    if (isRational) patch.weights.push_back(w);
  }
  return patch;
}

void requireBezierPatch(const BezierPatch& patch) {
  for (const int degree : patch.degree)
    if (degree < 1 || degree > levelset::kMostDegree)
      throw InvalidInput(fmt::format("the degree {} is out of range; give a degree from 1 to {}",
                                     degree, levelset::kMostDegree));
  const std::size_t count = patch.controlPointCount();
  if (patch.points.size() != count)
    throw InvalidInput(fmt::format("there are {} control points; give {} for these degrees",
                                   patch.points.size(), count));
  for (const std::vector<double>& attribute : patch.attributes)
    if (attribute.size() != count)
      throw InvalidInput(
          fmt::format("an attribute has {} numbers for {} control points; give one for each",
                      attribute.size(), count));
  if (!patch.weights.empty() && patch.weights.size() != count)
    throw InvalidInput(
        fmt::format("there are {} weights for {} control points; give one weight for each control "
                    "point, or none",
                    patch.weights.size(), count));
  for (std::size_t n = 0; n < count; ++n) {
    const V3d& p = patch.points[n];
    for (const double number : {p.x, p.y, p.z})
      if (!(std::abs(number) <= kLargestCoordinate))
        throw InvalidInput(
            fmt::format("control point {} is ({}, {}, {}); give finite coordinates up to {}", n,
                        p.x, p.y, p.z, kLargestCoordinate));
    for (const std::vector<double>& attribute : patch.attributes)
      if (!(std::abs(attribute[n]) <= kLargestCoordinate))
        throw InvalidInput(
            fmt::format("the attribute of control point {} is {}; give a finite number up to {}", n,
                        attribute[n], kLargestCoordinate));
    if (const double w = weightAt(patch, n); !(w >= kLeastWeight) || !(w <= kLargestWeight))
      throw InvalidInput(fmt::format("weight {} is {}; give positive weights from {} to {}", n, w,
                                     kLeastWeight, kLargestWeight));
  }
  if (patch.weights.empty()) return;
  const auto [least, largest] = std::minmax_element(patch.weights.begin(), patch.weights.end());
  if (*largest / *least > kLargestRatio)
    throw InvalidInput(fmt::format(
        "the weights range from {} to {}; give weights whose ratio is at most {:g}, or divide the "
        "patch",
        *least, *largest, kLargestRatio));
}

/// Operators of an expression.
constexpr int kUnion = -1, kIntersection = -2, kDifference = -3;

void requireExpression(const std::vector<int>& expression, std::size_t attributes) {
  std::size_t values = 0;
  bool isCorrect = true;
  for (const int step : expression) {
    isCorrect = isCorrect && step >= kDifference && step < static_cast<int>(attributes) &&
                (step >= 0 || values >= 2);
    values += step >= 0 ? 1 : -std::size_t{1};
  }
  if (!expression.empty() && !(isCorrect && values == 1))
    throw InvalidInput(
        fmt::format("the expression in postfix notation is not one of {} attributes; give an "
                    "operator after its two operands",
                    attributes));
}

bool isInsideOf(const std::vector<int>& expression, const std::vector<char>& inside) {
  if (expression.empty()) return inside[0] != 0;
  std::vector<char> stack;
  for (const int step : expression) {
    if (step >= 0) {
      stack.push_back(inside[static_cast<std::size_t>(step)]);
      continue;
    }
    const bool b = stack.back() != 0;
    stack.pop_back();
    const bool a = stack.back() != 0;
    stack.back() = step == kUnion ? a || b : step == kIntersection ? a && b : a && !b;
  }
  return stack.back() != 0;
}

}  // namespace

SurfaceSide sideOf(const std::vector<int>& expression, std::size_t attribute,
                   std::vector<char> inside) {
  inside[attribute] = 1;
  const bool with = isInsideOf(expression, inside);
  inside[attribute] = 0;
  const bool without = isInsideOf(expression, inside);
  return with == without ? SurfaceSide::None : with ? SurfaceSide::Same : SurfaceSide::Flipped;
}

V3d positionAt(const BezierPatch& patch, const V3d& parameter) {
  const std::vector<TensorBernstein> forms = homogeneous(patch);
  const auto at = [&](std::size_t form) {
    return levelset::valueAt(forms[form], {parameter.x, parameter.y, parameter.z});
  };
  return V3d(at(1), at(2), at(3)) / at(0);
}

double attributeAt(const BezierPatch& patch, std::size_t attribute, const V3d& parameter) {
  TensorBernstein value(patch.degree), weight(patch.degree);
  for (std::size_t n = 0; n < patch.points.size(); ++n) {
    weight.coefficients[n] = weightAt(patch, n);
    value.coefficients[n] = weight.coefficients[n] * patch.attributes[attribute][n];
  }
  const std::array<double, 3> u{parameter.x, parameter.y, parameter.z};
  return levelset::valueAt(value, u) / (patch.weights.empty() ? 1 : levelset::valueAt(weight, u));
}

std::vector<char> insideAt(const BezierPatch& patch, double isovalue, const V3d& parameter) {
  // Products of the Bernstein polynomials and the weight are common to all attributes.
  std::array<std::vector<double>, 3> rows;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double>& row = rows[axis];
    const double t = parameter[static_cast<int>(axis)];
    row.assign(1, 1.0);
    for (int order = 1; order <= patch.degree[axis]; ++order) {
      row.push_back(0);
      for (std::size_t i = row.size() - 1; i > 0; --i) row[i] = (1 - t) * row[i] + t * row[i - 1];
      row[0] *= 1 - t;
    }
  }
  std::vector<double> factors;
  factors.reserve(patch.points.size());
  for (const double a : rows[0])
    for (const double b : rows[1])
      for (const double c : rows[2]) factors.push_back(a * b * c * weightAt(patch, factors.size()));
  std::vector<char> inside;
  for (const std::vector<double>& attribute : patch.attributes) {
    double sum = 0;
    for (std::size_t n = 0; n < factors.size(); ++n) sum += factors[n] * (attribute[n] - isovalue);
    inside.push_back(sum < 0 ? 1 : 0);
  }
  return inside;
}

BezierPatch elevated(const BezierPatch& patch, int axis) {
  if (patch.degree[static_cast<std::size_t>(axis)] >= levelset::kMostDegree)
    throw InvalidInput(
        fmt::format("the degree is {} already, the largest that is supported; leave it as it is",
                    levelset::kMostDegree));
  std::vector<TensorBernstein> forms = homogeneous(patch);
  for (TensorBernstein& form : forms) form = levelset::elevated(form, axis);
  BezierPatch result = fromHomogeneous(forms, !patch.weights.empty());
  result.trim = patch.trim;
  return result;
}

BezierPatch surfacePatch(int degreeU, int degreeV, const std::vector<V3d>& points,
                         const std::vector<double>& weights, double isovalue) {
  BezierPatch patch;
  patch.degree = {degreeU, degreeV, 1};
  patch.attributes.resize(1);
  for (std::size_t n = 0; n < points.size(); ++n)
    for (const double w : {0.0, 1.0}) {
      patch.points.push_back(points[n]);
      patch.attributes[0].push_back(isovalue + w - 1.0 / 3);
      if (!weights.empty()) patch.weights.push_back(weights[n]);
    }
  return patch;
}

std::vector<BezierPatch> bezierPatches(const SplineVolume& volume) {
  for (const std::vector<double>& attribute : volume.attributes)
    if (attribute.size() != volume.points.size())
      throw InvalidInput(
          fmt::format("an attribute has {} numbers for {} control points; give one for each",
                      attribute.size(), volume.points.size()));
  const Imath::M44d cube =
      levelset::frameOf({Imath::V3d(0), Imath::V3d(1)});  // parameters are their own positions
  const levelset::BezierPieces ofPositions{levelset::ControlLattice(
      levelset::LatticeData{volume.axes, cube, volume.points, volume.weights})};
  std::vector<levelset::BezierPieces> ofAttributes;  // as lattices along x
  for (const std::vector<double>& attribute : volume.attributes) {
    levelset::LatticeData data{volume.axes, cube, {}, volume.weights};
    for (const double value : attribute) data.points.emplace_back(value, 0, 0);
    ofAttributes.emplace_back(levelset::ControlLattice(std::move(data)));
  }
  const bool isRational = !volume.weights.empty();
  std::vector<BezierPatch> result;
  for (std::size_t n = 0; n < ofPositions.size(); ++n) {
    levelset::BezierPiece piece = ofPositions.piece(n);
    std::vector<TensorBernstein> forms{std::move(piece.weight)};
    for (TensorBernstein& form : piece.numerator) forms.push_back(std::move(form));
    for (const levelset::BezierPieces& attribute : ofAttributes)
      forms.push_back(attribute.piece(n).numerator[0]);
    result.push_back(fromHomogeneous(forms, isRational));
  }
  return result;
}

void trimPatches(const SplineVolume& volume, const std::shared_ptr<const TrimRegion>& region,
                 std::vector<BezierPatch>& patches, const Imath::Box2d& domain) {
  const auto placed = [&](double u, double v) {
    return Imath::V2d(domain.min.x * (1 - u) + domain.max.x * u,
                      domain.min.y * (1 - v) + domain.max.y * v);
  };
  std::array<std::vector<Imath::V2d>, 3> spans;  // ends of the spans of each axis
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& knots = volume.axes[axis].knots;
    for (std::size_t n = 0; n + 1 < knots.size(); ++n)
      if (knots[n + 1] > knots[n]) spans[axis].emplace_back(knots[n], knots[n + 1]);
  }
  std::size_t number = 0;
  for (const Imath::V2d& u : spans[0])
    for (const Imath::V2d& v : spans[1])
      for (std::size_t n = 0; n < spans[2].size(); ++n)
        patches[number++].trim = std::make_shared<const PatchTrim>(
            PatchTrim{region, {placed(u[0], v[0]), placed(u[1], v[1])}});
}

Imath::Box3d BezierVolume::bounds() const {
  Imath::Box3d box;
  for (const BezierPatch& patch : patches)
    for (const V3d& point : patch.points) box.extendBy(point);
  return box;
}

std::size_t BezierVolume::bytes() const {
  std::size_t sum = 0;
  const TrimRegion* last = nullptr;  // patches of one surface follow each other
  for (const BezierPatch& patch : patches) {
    if (patch.trim && patch.trim->region.get() != last) sum += patch.trim->region->bytes();
    if (patch.trim) last = patch.trim->region.get();
    sum += sizeof(V3d) * patch.points.size() +
           sizeof(double) * (patch.attributes.size() * patch.points.size() + patch.weights.size());
  }
  return sum;
}

void requireBezierVolume(const BezierVolume& volume) {
  if (volume.patches.empty()) throw InvalidInput("the volume has no patch; give at least one");
  if (!(std::abs(volume.isovalue) <= kLargestCoordinate))
    throw InvalidInput(fmt::format("the isovalue is {}; give a finite number", volume.isovalue));
  const std::size_t attributes = volume.attributeCount();
  if (attributes == 0) throw InvalidInput("the patches have no attribute; give at least one");
  if (attributes > 1 && volume.expression.empty())
    throw InvalidInput(fmt::format(
        "the patches have {} attributes and no expression; give an expression", attributes));
  requireExpression(volume.expression, attributes);
  for (const BezierPatch& patch : volume.patches)
    if (patch.attributes.size() != attributes)
      throw InvalidInput(
          fmt::format("a patch has {} attributes and another one {}; give equal "
                      "numbers",
                      patch.attributes.size(), attributes));
  for (std::size_t n = 0; n < volume.patches.size(); ++n)
    levelset::withContext(fmt::format("patch {}", n),
                          [&] { requireBezierPatch(volume.patches[n]); });
}

}  // namespace render
