#include "mapping/generators/gyroid.h"

#include <Imath/ImathMatrix.h>

#include <cmath>
#include <numbers>

#include "mapping/generators/generator_vdb.h"

namespace mapping {
namespace {

using Imath::M33d;
using Imath::V3d;
using levelset::ShapeExtent;
using levelset::ShapeOptions;

constexpr double kTurn = 2 * std::numbers::pi;
// Largest gradient of sin x cos y + sin y cos z + sin z cos x, per radian.
constexpr double kSteepest = 1.7320508075688773;
// Area of the gyroid surface in one cell, in units of the squared cell edge.
constexpr double kCellArea = 3.0968;
// Distance from the axis of a labyrinth's strut to the gyroid surface where the strut is thinnest,
// as a multiple of the cell edge.
constexpr double kNeck = kThickestGyroidWall / 2;

/// Value and derivatives of sin x cos y + sin y cos z + sin z cos x at a point, in radians.
struct GyroidJet {
  double value;
  V3d slope;
  M33d curvature;  ///< second derivatives

  explicit GyroidJet(const V3d& p) {
    const V3d s(std::sin(p.x), std::sin(p.y), std::sin(p.z)),
        c(std::cos(p.x), std::cos(p.y), std::cos(p.z));
    value = s.x * c.y + s.y * c.z + s.z * c.x;
    slope = {c.x * c.y - s.z * s.x, c.y * c.z - s.x * s.y, c.z * c.x - s.y * s.z};
    const double xy = -c.x * s.y, yz = -c.y * s.z, zx = -c.z * s.x;
    curvature = {-s.x * c.y - s.z * c.x,
                 xy,
                 zx,  //
                 xy,
                 -s.y * c.z - s.x * c.y,
                 yz,  //
                 zx,
                 yz,
                 -s.z * c.x - s.y * c.z};
  }
};

double gyroidValue(const V3d& p) {
  return std::sin(p.x) * std::cos(p.y) + std::sin(p.y) * std::cos(p.z) +
         std::sin(p.z) * std::cos(p.x);
}

/// Distance from p to a foot point on the gyroid surface, radians. With g the formula of the
/// gyroid, Newton's method solves x − p + λ ∇g = 0, g = 0 for the foot x and the multiplier λ
/// [Saye14]. It starts where the given x projects onto the surface along ∇g. Returns HUGE_VAL if it
/// does not converge.
double distanceToFoot(const V3d& p, V3d x) {
  for (int i = 0; i < 2; ++i) {
    const GyroidJet g(x);
    x -= g.slope * (g.value / std::max(g.slope.length2(), 0.25));
  }
  // Projects p onto the tangent plane of the surface at x, a few times. This moves x towards the
  // foot point, into the region in which Newton's method converges.
  for (int i = 0; i < 4; ++i) {
    const GyroidJet g(x);
    const double squared = std::max(g.slope.length2(), 0.25);
    const V3d back = p - x;
    x += back - g.slope * ((g.value + (back ^ g.slope)) / squared);
  }
  double multiplier = 0;
  {
    const GyroidJet g(x);
    multiplier = ((p - x) ^ g.slope) / std::max(g.slope.length2(), 0.25);
  }
  constexpr int kMostSteps = 20;
  for (int i = 0; i < kMostSteps; ++i) {
    const GyroidJet g(x);
    M33d system = g.curvature * multiplier;
    for (int axis = 0; axis < 3; ++axis) system[axis][axis] += 1;
    // The matrix is symmetric. Imath returns the identity for a singular matrix.
    const M33d inverse = system.inverse();
    const V3d u = g.slope * inverse, v = (p - x - g.slope * multiplier) * inverse;
    const double pivot = g.slope ^ u;
    if (!(std::abs(pivot) > 1e-12)) break;
    const double change = (g.value + (g.slope ^ v)) / pivot;
    const V3d step = v - u * change;
    x += step;
    multiplier += change;
    if (step.length2() < 1e-26) break;
  }
  return std::abs(gyroidValue(x)) < 1e-9 ? (x - p).length() : HUGE_VAL;
}

/// Distance from p to the gyroid surface, radians. A foot point much further away than the lower
/// bound `least` of the distance may not be the nearest one. Newton's method then also starts from
/// eight positions around p.
double distanceToSurface(const V3d& p) {
  const double least = std::abs(gyroidValue(p)) / kSteepest;
  double best = distanceToFoot(p, p);
  // kPlain: ratio of distance to lower bound up to which the first foot point is accepted. The
  // ratio reaches this value at the necks of the labyrinths. kAround: offset of the eight further
  // starts from p along each axis, radians.
  constexpr double kPlain = 1.34, kAround = 0.4;
  if (best <= kPlain * least) return best;
  for (int corner = 0; corner < 8; ++corner) {
    const V3d aside(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    best = std::min(best, distanceToFoot(p, p + aside * kAround));
  }
  return std::isfinite(best) ? best : least;
}

void requireGyroid(const Gyroid& gyroid, const V3d& center) {
  requirePositive(gyroid.cell, "the cell");
  requirePositive(gyroid.thickness, "the thickness");
  const bool isSheet = gyroid.kind == GyroidKind::Sheet;
  const double most = (isSheet ? kThickestGyroidWall : kThickestGyroidStrut) * gyroid.cell;
  if (gyroid.thickness >= most) {
    throw levelset::UsageError(
        fmt::format("a thickness of {:.6g} closes all openings between the {} in a cell of {:.6g}; "
                    "give less than {:.6g}",
                    gyroid.thickness, isSheet ? "walls" : "struts", gyroid.cell, most));
  }
  for (const int count : gyroid.cells) {
    if (count >= 1 && count <= 1'000'000) continue;
    throw levelset::UsageError(
        fmt::format("the gyroid has {} cells along an axis; give 1 to 1000000", count));
  }
  requireFinite(center, "the centre");
}

class GyroidField {
 public:
  GyroidField(const Gyroid& gyroid, const V3d& corner, double reach)
      : isSheet_(gyroid.kind == GyroidKind::Sheet),
        // World units. The solid consists of the points whose distance to the gyroid surface
        // (unsigned for a sheet, signed for a network) is below this offset.
        offset_(isSheet_ ? gyroid.thickness / 2 : gyroid.thickness / 2 - kNeck * gyroid.cell),
        cell_(gyroid.cell),
        corner_(corner),
        reach_(reach) {}

  double operator()(const V3d& world) const {
    const V3d p = world - corner_;
    const double value = gyroidValue(p * (kTurn / cell_));
    // Lower bound of the distance, from the largest gradient of the formula.
    double least = value / kSteepest * cell_ / kTurn;
    if (isSheet_) least = std::abs(least);
    if (least - offset_ > reach_ || (!isSheet_ && least - offset_ < -reach_ && least < 0))
      return least - offset_;
    const double distance = gyroidDistance(p, cell_);
    return (isSheet_ ? std::abs(distance) : distance) - offset_;
  }

 private:
  bool isSheet_;
  double offset_, cell_;
  V3d corner_;
  double reach_;
};

}  // namespace

double gyroidDistance(const V3d& position, double cell) {
  const V3d p = position * (kTurn / cell);
  return std::copysign(distanceToSurface(p) * cell / kTurn, gyroidValue(p));
}

TileBox gyroidBox(const Gyroid& gyroid, const V3d& center) {
  requireGyroid(gyroid, center);
  const V3d half = V3d(gyroid.cells[0], gyroid.cells[1], gyroid.cells[2]) * (gyroid.cell / 2);
  return {{center - half, center + half}, {center - half, center + half}};
}

ShapeExtent gyroidExtent(const Gyroid& gyroid, const V3d& center) {
  const Imath::Box3d bounds = gyroidBox(gyroid, center).whole;
  const V3d size = bounds.size();
  const double cells = size.x * size.y * size.z / std::pow(gyroid.cell, 3);
  const double sides = gyroid.kind == GyroidKind::Sheet ? 2 : 1;
  return {bounds, cells * sides * kCellArea * gyroid.cell * gyroid.cell + size.x * size.y +
                      size.y * size.z + size.z * size.x};
}

void checkGyroid(const Gyroid& gyroid, const V3d& center, double voxelSize,
                 const ShapeOptions& options) {
  const ShapeExtent extent = gyroidExtent(gyroid, center);
  levelset::checkShape(extent, voxelSize, options);
  requireResolved(gyroid.thickness, voxelSize, "the thickness");
  const double most = gyroid.kind == GyroidKind::Sheet ? kThickestGyroidWall : kThickestGyroidStrut;
  requireResolved(most * gyroid.cell - gyroid.thickness, voxelSize, "the opening at the necks");
}

levelset::NarrowBand makeGyroid(const Gyroid& gyroid, const V3d& center, double voxelSize,
                                const ShapeOptions& options) {
  checkGyroid(gyroid, center, voxelSize, options);
  const ShapeExtent extent = gyroidExtent(gyroid, center);
  const double exact = (options.halfWidth + 0.5) * voxelSize;
  const GyroidField solid(gyroid, extent.bounds.min, exact);
  return levelset::makeShape(extent, voxelSize, options, [&](const V3d& p) {
    return clippedDistance(solid, p, extent.bounds, exact, voxelSize);
  });
}

}  // namespace mapping
