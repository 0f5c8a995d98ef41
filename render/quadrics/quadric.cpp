#include "render/quadrics/quadric.h"

#include <Imath/ImathMatrix.h>
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "levelset/error.h"

namespace render {
namespace {

using Imath::V3d;
using levelset::InvalidInput;

constexpr double kLargestCoordinate = 1e15;
constexpr std::size_t kMostQuadrics = std::size_t{1} << 30;
// Least volume of the axes, as a share of the product of their lengths. Their rounding to single
// precision changes it by about 1e-7.
constexpr double kFlattest = 1e-5;

bool isUsable(const V3d& v) {
  for (int c = 0; c < 3; ++c)
    if (!(std::abs(v[c]) <= kLargestCoordinate)) return false;
  return true;
}

void requireUsable(const V3d& v, const char* what) {
  if (!isUsable(v))
    throw InvalidInput(fmt::format(
        "has {} ({}, {}, {}) with a number that is not finite or exceeds 1e15; give finite numbers "
        "up to 1e15",
        what, v.x, v.y, v.z));
}

void requireRadius(float radius) {
  if (!(radius > 0) || !(static_cast<double>(radius) <= kLargestCoordinate))
    throw InvalidInput(fmt::format("has the radius {}; give a positive one up to 1e15", radius));
}

/// Checks a list. Messages name the kind and the number of an entry, from 1.
template <typename Primitive>
void requireAll(const std::vector<Primitive>& list, const char* noun) {
  for (std::size_t n = 0; n < list.size(); ++n) {
    try {
      requireQuadric(list[n]);
    } catch (const InvalidInput& error) {
      throw InvalidInput(fmt::format("{} {} {}", noun, n + 1, error.what()));
    }
  }
}

/// Square of the radius at a height in parameter space.
double radiusSquare(QuadricKind kind, double z) {
  switch (kind) {
    case QuadricKind::Cylinder:
      return 1;
    case QuadricKind::Cone:
      return z * z;
    case QuadricKind::Paraboloid:
      return z;
    case QuadricKind::OneSheet:
      return 1 + z * z;
    case QuadricKind::TwoSheet:
      return z * z - 1;
    default:
      return 1 - z * z;
  }
}

/// Extremes of a quotient of linear functions of parameter space.
struct ExtentSearch {
  const Quadric& quadric;
  HomogeneousRow p, s;  // numerator and denominator, in parameter space
  bool isFound = false;
  QuadricExtent extent = {};

  void add(double value) {
    if (!std::isfinite(value)) return;
    extent.low = isFound ? std::min(extent.low, value) : value;
    extent.high = isFound ? std::max(extent.high, value) : value;
    isFound = true;
  }

  /// Calls take(b) with the roots of s∘s b² − 2 p∘s b + p∘p, where ∘ is a symmetric product.
  /// @param isClosed  the quadric is, so that there are roots in spite of rounding
  template <typename Product, typename Take>
  void roots(const Product& product, bool isClosed, const Take& take) const {
    const double a = product(s, s), b = product(p, s), c = product(p, p), square = b * b - a * c;
    if (square < 0 && !isClosed) return;
    const double root = std::sqrt(std::max(0.0, square));
    const double h = b < 0 ? b - root : b + root;  // a r² − 2 b r + c, without cancellation
    if (a != 0) take(h / a);
    if (h != 0) take(c / h);
  }

  [[nodiscard]] static double at(const HomogeneousRow& row, double z) {
    return row[3] + z * row[2];
  }

  /// The ring of the quadric at a height, or its disk.
  void addRing(double z) {
    const double square = radiusSquare(quadric.kind, z);
    if (square < 0) return;
    if (square == 0) return add(at(p, z) / at(s, z));
    roots(
        [&](const HomogeneousRow& m, const HomogeneousRow& n) {
          return square * (m[0] * n[0] + m[1] * n[1]) - at(m, z) * at(n, z);
        },
        true, [&](double b) { add(b); });
  }

  /// Planes that touch the quadric between its ends.
  void addSurface() {
    const QuadricKind kind = quadric.kind;
    const auto product = [&](const HomogeneousRow& m, const HomogeneousRow& n) {
      const double across = m[0] * n[0] + m[1] * n[1];
      switch (kind) {
        case QuadricKind::Paraboloid:
          return across - 2 * (m[2] * n[3] + m[3] * n[2]);
        case QuadricKind::TwoSheet:
          return across - m[2] * n[2] + m[3] * n[3];
        default:
          return across + m[2] * n[2] - m[3] * n[3];
      }
    };
    roots(product, kind == QuadricKind::Ellipsoid, [&](double b) {
      if (kind == QuadricKind::Ellipsoid) return add(b);
      const double nz = p[2] - b * s[2], nw = p[3] - b * s[3];
      const double z = kind == QuadricKind::Paraboloid ? nw / nz : -nz / nw;
      if (z >= quadric.range.low && z <= quadric.range.high) add(b);
    });
  }
};

HomogeneousRow inParameters(const Quadric& quadric, const HomogeneousRow& row) {
  const V3d direction(row[0], row[1], row[2]);
  return {direction.dot(quadric.axes[0]), direction.dot(quadric.axes[1]),
          direction.dot(quadric.axes[2]), direction.dot(quadric.position) + row[3]};
}

std::optional<QuadricExtent> search(const Quadric& quadric, const HomogeneousRow& numerator,
                                    const HomogeneousRow& denominator) {
  ExtentSearch result{quadric, inParameters(quadric, numerator),
                      inParameters(quadric, denominator)};
  const auto& [low, high] = quadric.range;
  switch (quadric.kind) {
    case QuadricKind::Ellipsoid:
      result.addSurface();
      break;
    case QuadricKind::Paraboloid:
    case QuadricKind::TwoSheet:  // they bulge between their ends
      result.addSurface();
      [[fallthrough]];
    default:
      result.addRing(low);
      result.addRing(high);
      if (quadric.kind == QuadricKind::Cone && low < 0 && high > 0) result.addRing(0);
  }
  return result.isFound ? std::optional(result.extent) : std::nullopt;
}

}  // namespace

const char* nameOf(QuadricKind kind) {
  constexpr std::array<const char*, kQuadricKinds> kNames = {"ellipsoid",
                                                             "cylinder",
                                                             "cone",
                                                             "paraboloid",
                                                             "one-sheet hyperboloid",
                                                             "two-sheet hyperboloid"};
  return kNames[static_cast<std::size_t>(kind)];
}

QuadricRange defaultRange(QuadricKind kind) {
  switch (kind) {
    case QuadricKind::Cone:
    case QuadricKind::Paraboloid:
      return {0, 1};
    case QuadricKind::TwoSheet:
      return {-2, 2};
    default:
      return {-1, 1};
  }
}

std::uint32_t packedColour(const Imath::C3f& colour) {
  std::uint32_t packed = 0;
  for (int c = 0; c < 3; ++c) {
    const float channel = colour[c] > 0 ? std::min(colour[c], 1.0f) : 0.0f;
    packed |= static_cast<std::uint32_t>(std::lround(255 * channel)) << (8 * c);
  }
  return packed;
}

Imath::C3f unpackedColour(std::uint32_t colour) {
  const auto channel = [&](int n) { return static_cast<float>(colour >> (8 * n) & 255) / 255; };
  return {channel(0), channel(1), channel(2)};
}

Quadric quadricOf(const Ball& ball) {
  Quadric quadric;
  const auto r = static_cast<double>(ball.radius);
  quadric.position = ball.centre;
  quadric.axes = {V3d(r, 0, 0), V3d(0, r, 0), V3d(0, 0, r)};
  quadric.colour = unpackedColour(ball.colour);
  return quadric;
}

Quadric quadricOf(const Stick& stick) {
  Quadric quadric;
  quadric.kind = QuadricKind::Cylinder;
  quadric.position = 0.5 * (stick.a + stick.b);
  const V3d along = 0.5 * (stick.b - stick.a);
  int least = 0;
  for (int c = 1; c < 3; ++c)
    if (std::abs(along[c]) < std::abs(along[least])) least = c;
  V3d other(0);
  other[least] = 1;
  const V3d across = along.cross(other).normalized(), third = along.cross(across).normalized();
  const auto r = static_cast<double>(stick.radius);
  quadric.axes = {across * r, third * r, along};
  quadric.colour = unpackedColour(stick.colour);
  return quadric;
}

void requireQuadric(const Ball& ball) {
  requireUsable(ball.centre, "a centre");
  requireRadius(ball.radius);
}

void requireQuadric(const Stick& stick) {
  requireUsable(stick.a, "an end");
  requireUsable(stick.b, "an end");
  requireRadius(stick.radius);
  if (stick.a == stick.b)
    throw InvalidInput("has ends at the same position; give two different ones");
}

void requireQuadric(const Quadric& quadric) {
  requireUsable(quadric.position, "a position");
  double product = 1;
  for (const V3d& axis : quadric.axes) {
    requireUsable(axis, "an axis");
    if (!(axis.length() > 0)) throw InvalidInput("has an axis of length 0; give a longer one");
    product *= axis.length();
  }
  const double volume = quadric.axes[0].dot(quadric.axes[1].cross(quadric.axes[2]));
  if (!(std::abs(volume) > kFlattest * product))
    throw InvalidInput("has axes in one plane; give three independent ones");
  if (quadric.kind == QuadricKind::Ellipsoid) return;
  const auto& [low, high] = quadric.range;
  if (!(std::abs(low) <= kLargestCoordinate) || !(std::abs(high) <= kLargestCoordinate) ||
      !(static_cast<float>(low) < static_cast<float>(high)))
    throw InvalidInput(
        fmt::format("has the range {} … {}; give finite ends, the lower one first, that differ in "
                    "single precision",
                    low, high));
  const bool isBelow = quadric.kind == QuadricKind::Paraboloid && !(high > 0);
  const bool isBetween = quadric.kind == QuadricKind::TwoSheet && !(high > 1) && !(low < -1);
  if (isBelow || isBetween)
    throw InvalidInput(fmt::format(
        "has no point in the range {} … {}, because a {} {}", low, high, nameOf(quadric.kind),
        isBelow ? "begins at 0; give a range that reaches above 0"
                : "has none between -1 and 1; give a range that reaches beyond"));
}

void requireQuadrics(const QuadricModel& model) {
  if (model.size() == 0) throw InvalidInput("there is no quadric; give at least one");
  if (model.size() > kMostQuadrics)
    throw InvalidInput(
        fmt::format("there are {} quadrics, and a part has at most 2^30; divide them into several "
                    "parts",
                    model.size()));
  requireAll(model.balls, "sphere");
  requireAll(model.sticks, "cylinder");
  requireAll(model.quadrics, "quadric");
}

std::optional<QuadricExtent> extentOf(const Quadric& quadric, const HomogeneousRow& numerator,
                                      const HomogeneousRow& denominator) {
  constexpr HomogeneousRow kAffine = {0, 0, 0, 1};
  if (denominator != kAffine) {
    const std::optional<QuadricExtent> depth = search(quadric, denominator, kAffine);
    if (!depth || !(depth->low > 0)) return std::nullopt;
  }
  return search(quadric, numerator, denominator);
}

Imath::Box3d boundsOf(const Quadric& quadric) {
  Imath::Box3d box;
  for (int axis = 0; axis < 3; ++axis) {
    HomogeneousRow row{};
    row[static_cast<std::size_t>(axis)] = 1;
    const std::optional<QuadricExtent> extent = extentOf(quadric, row);
    if (!extent) return {};
    box.min[axis] = extent->low;
    box.max[axis] = extent->high;
  }
  return box;
}

std::optional<Imath::Box2d> pictureBox(const Quadric& quadric, const Camera& camera) {
  const Imath::M44d toNdc = camera.worldToNdc();  // its columns are linear functions
  const auto column = [&](int c, double scale) {
    return HomogeneousRow{scale * toNdc[0][c], scale * toNdc[1][c], scale * toNdc[2][c],
                          scale * toNdc[3][c]};
  };
  const HomogeneousRow depth = column(3, 1);
  const auto x = extentOf(quadric, column(0, camera.width), depth),
             y = extentOf(quadric, column(1, camera.height), depth);
  if (!x || !y) return std::nullopt;
  return Imath::Box2d({x->low, y->low}, {x->high, y->high});
}

}  // namespace render
