#include "levelset/csg/csg.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "apps/regress/truth/golden_section.h"
#include "levelset/csg/smooth_csg.h"

namespace regress {

using Imath::V3d;
using levelset::CsgOperation;
using levelset::NarrowBand;

namespace {

struct Named {
  CsgOperation operation;
  const char* name;
};
constexpr std::array<Named, 3> kOperations = {{{CsgOperation::Union, "union"},
                                               {CsgOperation::Intersection, "intersection"},
                                               {CsgOperation::Difference, "difference"}}};

const V3d kApart(0.9, 0.3, 0.2);

/// Excludes grid points within 1.5 voxels of the crease from the comparison, since the grid does
/// not resolve the position of the crease between grid points.
Truth awayFromCrease(Truth truth, const V3d& a, const V3d& b, double radius, double voxelSize) {
  const V3d middle = (a + b) / 2.0, axis = (b - a).normalized();
  const double ring = std::sqrt(radius * radius - (b - a).length2() / 4);
  truth.compared = [=](const V3d& p) {
    const double along = (p - middle).dot(axis);
    return std::hypot((p - middle - along * axis).length() - ring, along) > 1.5 * voxelSize;
  };
  return truth;
}

void combineBalls(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const V3d a = at.shift, b = at.shift + kApart;
    const NarrowBand first = exactBand(ball(a, 1), at.voxelSize),
                     second = exactBand(ball(b, 1), at.voxelSize);
    for (const Named& op : kOperations) {
      const Truth truth = twoBalls(op.operation, a, 1, b, 1);
      const Subject subject{op.name, at, awayFromCrease(truth, a, b, 1, at.voxelSize)};
      const std::array<NarrowBand, 2> both{first, second};
      out.measure(subject, kOurs, [&] { return levelset::combine(op.operation, both).band; });
      if (out.wantsPeer(at, 16))
        out.measure(subject, peer::kCsg,
                    [&] { return peer::combine(op.operation, first, second); });
    }
  }
}

/// Zero set of smin(a, b) in a plane that both surfaces cross at right angles [Quilez13]. Where the
/// distances differ by K or more, it is the surface of one solid alone. In between it is an arc,
/// along which a − b runs from −K to K.
struct SmoothArc {
  double radius = 0;  ///< blend radius K of smin(a, b), world units
  std::function<V3d(double a, double b)> position =
      {};  ///< point of the plane at the distances a and b from the two surfaces

  [[nodiscard]] V3d at(double difference) const {
    const double gap = radius - std::abs(difference), less = gap * gap / (4 * radius);
    return difference > 0 ? position(less + difference, less) : position(less, less - difference);
  }

  /// Returns the distance from a point of the plane to the arc: the best of 64 intervals, refined
  /// by golden-section search.
  [[nodiscard]] double distance(const V3d& p) const {
    constexpr int kIntervals = 64;
    const auto squared = [&](double d) { return (at(d) - p).length2(); };
    return std::sqrt(squared(minimumBySections(squared, -radius, radius, kIntervals)));
  }
};

double smoothMinimum(double a, double b, double radius) {
  const double gap = std::max(radius - std::abs(a - b), 0.0);
  return std::min(a, b) - gap * gap / (4 * radius);
}

/// Smooth union of two balls: a surface of revolution about the line through their centres.
Truth smoothBalls(const V3d& centreA, double radiusA, const V3d& centreB, double radiusB,
                  double radius) {
  const double apart = (centreB - centreA).length();
  const V3d axis = (centreB - centreA) / apart;
  const SmoothArc arc{radius, [=](double a, double b) {
                        const double u = radiusA + a, v = radiusB + b;
                        const double x = (u * u - v * v + apart * apart) / (2 * apart);
                        return V3d(x, std::sqrt(std::max(u * u - x * x, 0.0)), 0);
                      }};
  const auto distance = [=](const V3d& p) {
    const double x = (p - centreA).dot(axis), y = (p - centreA - x * axis).length();
    const V3d in(x, y, 0), b(apart, 0, 0);
    const double toA = in.length() - radiusA, toB = (in - b).length() - radiusB;
    double least = arc.distance(in);
    // The nearest point of one ball lies on the surface of the smooth union only if it is at least
    // `radius` away from the other ball.
    const V3d footA = in.normalized() * radiusA, footB = b + (in - b).normalized() * radiusB;
    if ((footA - b).length() - radiusB >= radius) least = std::min(least, std::abs(toA));
    if (footB.length() - radiusA >= radius) least = std::min(least, std::abs(toB));
    return std::copysign(least, smoothMinimum(toA, toB, radius));
  };
  return {.distance = distance, .centre = (centreA + centreB) / 2.0, .reach = apart + 1.5};
}

/// Smooth union of two half spaces that leave the angle `degrees` of free space between them.
/// Points within a distance of 1 from the corner, a point of the edge along z, are compared.
Truth smoothPlanes(const V3d& corner, double degrees, double radius) {
  const double half = degrees / 2 * std::numbers::pi / 180;
  const V3d normalA(std::sin(half), -std::cos(half), 0), normalB(std::sin(half), std::cos(half), 0);
  const double alongX = 0.5 / std::sin(half), alongY = 0.5 / std::cos(half);
  const SmoothArc arc{
      radius, [=](double a, double b) { return V3d((a + b) * alongX, (b - a) * alongY, 0); }};
  const auto distance = [=](const V3d& p) {
    const V3d in(p.x - corner.x, p.y - corner.y, 0);
    const double toA = in.dot(normalA), toB = in.dot(normalB);
    double least = arc.distance(in);
    if ((in - toA * normalA).dot(normalB) >= radius) least = std::min(least, std::abs(toA));
    if ((in - toB * normalB).dot(normalA) >= radius) least = std::min(least, std::abs(toB));
    return std::copysign(least, smoothMinimum(toA, toB, radius));
  };
  Truth truth{.distance = distance, .centre = corner, .reach = 1};
  truth.compared = [=](const V3d& p) { return (p - corner).length() < 1; };
  return truth;
}

/// Slab that stands for one half space of smoothPlanes(): `side` −1 has the normal A, 1 has B. The
/// face through the corner is much larger than the blend.
Truth slabBelow(const V3d& corner, double degrees, double side) {
  Imath::M44d turn, shift;
  turn.setAxisAngle(V3d(0, 0, 1), side * (90 - degrees / 2) * std::numbers::pi / 180);
  shift.setTranslation(corner);
  return moved(box(V3d(-1, 0, 0), V3d(2, 4, 4)), turn * shift);
}

void smoothlyUniteBalls(Recorder& out) {
  constexpr double kRadius = 0.4;
  for (const Sample& at : out.samples()) {
    const V3d a = at.shift, b = at.shift + kApart;
    const NarrowBand first = exactBand(ball(a, 1), at.voxelSize),
                     second = exactBand(ball(b, 0.8), at.voxelSize);
    out.measure({"balls", at, smoothBalls(a, 1, b, 0.8, kRadius)}, kOurs, [&] {
      return levelset::smoothCombine(CsgOperation::Union, first, second, {.radius = kRadius}).band;
    });
  }
}

void smoothlyUnitePlanes(Recorder& out) {
  constexpr double kRadius = 0.4;
  for (const Sample& at : out.samples())
    for (const double degrees : {60.0, 90.0, 120.0}) {
      if (degrees != 90 && out.isQuick() && at.phase != kQuickPhase) continue;
      const NarrowBand first = exactBand(slabBelow(at.shift, degrees, -1), at.voxelSize),
                       second = exactBand(slabBelow(at.shift, degrees, 1), at.voxelSize);
      const Subject subject{fmt::format("planes, {:.0f} degrees", degrees), at,
                            smoothPlanes(at.shift, degrees, kRadius)};
      out.measure(subject, kOurs, [&] {
        return levelset::smoothCombine(CsgOperation::Union, first, second, {.radius = kRadius})
            .band;
      });
    }
}

void laws(Recorder& out) {
  using levelset::intersect, levelset::subtract, levelset::unite;
  for (const Sample& at : out.samples()) {
    const double h = at.voxelSize;
    const NarrowBand a = exactBand(ball(at.shift, 1), h),
                     b = exactBand(ball(at.shift + kApart, 1), h),
                     all = exactBand(box(at.shift, V3d(4)), h);
    const auto law = [&](const char* name, const NarrowBand& left, const NarrowBand& right) {
      out.row(name, kOurs, at, {{"voxel_size", h}, {"deviation_vx", deviation(left, right)}});
    };
    law("A ∪ A = A", unite(a, a), a);
    law("A ∩ A = A", intersect(a, a), a);
    law("A ∪ B = B ∪ A", unite(a, b), unite(b, a));
    law("A ∩ B = B ∩ A", intersect(a, b), intersect(b, a));
    law("X \\ (A ∪ B) = (X \\ A) ∩ (X \\ B)", subtract(all, unite(a, b)),
        intersect(subtract(all, a), subtract(all, b)));
    law("X \\ (A ∩ B) = (X \\ A) ∪ (X \\ B)", subtract(all, intersect(a, b)),
        unite(subtract(all, a), subtract(all, b)));
    if (at.phase == kQuickPhase)
      out.expectRefusal("A \\ A at " + std::to_string(at.resolution), levelset::ExitCode::Input,
                        [&] { (void)subtract(a, a); });
  }
}

/// The grid values determine the position of the crease only to a third of a voxel. This limits the
/// accuracy of the band where the crease is the nearest part of the surface.
Bounds csgBallsBounds() {
  return Bounds()
      .measured("union", "band_in_linf_vx",
                {{12, 0.0412},
                 {16, 0.0539},
                 {32, 0.0557, Budget::Quick},
                 {32, 0.0601, Budget::Full},
                 {64, 0.0731},
                 {128, 0.0793},
                 {256, 0.0615}})
      .rounding("union", "band_out_linf_vx", 1.5)
      .measured("union", "band_in_l1_vx",
                {{12, 0.000443},
                 {16, 0.000239},
                 {32, 6.5e-5, Budget::Quick},
                 {32, 6.74e-5, Budget::Full}})
      .rounding("union", "band_out_l1_vx", 0.5)
      .zero("union", "checks_failed")
      .rounding("intersection", "band_in_linf_vx", 1.5)
      .measured("intersection", "band_out_linf_vx",
                {{12, 0.0527},
                 {16, 0.0507},
                 {32, 0.0287, Budget::Quick},
                 {32, 0.0434, Budget::Full},
                 {64, 0.0528},
                 {128, 0.0618},
                 {256, 0.074}})
      .rounding("intersection", "band_in_l1_vx", 0.5)
      .measured("intersection", "band_out_l1_vx",
                {{12, 0.00153},
                 {16, 0.000493},
                 {32, 0.000135, Budget::Quick},
                 {32, 0.000142, Budget::Full}})
      .zero("intersection", "checks_failed")
      .rounding("difference", "band_in_linf_vx", 1.5)
      .measured("difference", "band_out_linf_vx",
                {{12, 0.277},
                 {16, 0.128},
                 {32, 0.322, Budget::Quick},
                 {32, 0.322, Budget::Full},
                 {64, 0.239},
                 {128, 0.257},
                 {256, 0.322}})
      .ceiling(0.4)
      .rounding("difference", "band_in_l1_vx", 0.5)
      .measured("difference", "band_out_l1_vx",
                {{12, 0.00122},
                 {16, 0.00072},
                 {32, 0.000367, Budget::Quick},
                 {32, 0.000367, Budget::Full}})
      .zero("difference", "checks_failed")
      .measured("union", "volume_error",
                {{12, 0.000131}, {16, 6.93e-6}, {32, 1.92e-5, Budget::Quick}, {64, 1.85e-5}})
      .measured("intersection", "volume_error",
                {{12, 0.00118}, {16, 0.000522}, {32, 0.000101, Budget::Quick}, {64, 4.61e-5}})
      .measured("difference", "volume_error",
                {{12, 0.0094}, {16, 0.00447}, {32, 0.00236, Budget::Quick}, {64, 0.00124}});
}

Bounds smoothBallsBounds() {
  return Bounds()
      .measured("balls", "band_in_linf_vx", {{8, 0.00517}, {16, 0.00231}, {32, 0.00112}})
      .measured("balls", "band_out_linf_vx", {{8, 0.00515}, {16, 0.00236}, {32, 0.00113}})
      .measured("balls", "surface_l1_vx", {{8, 0.000499}, {16, 0.000117}, {32, 3.03e-05}});
}

Bounds smoothPlanesBounds() {
  return Bounds()
      .measured("planes, 120 degrees", "band_in_linf_vx",
                {{8, 0.00651}, {12, 0.00381}, {16, 0.00306}})
      .measured("planes, 120 degrees", "band_out_linf_vx",
                {{8, 0.00623}, {12, 0.00321}, {16, 0.00299}})
      .measured("planes, 120 degrees", "surface_l1_vx",
                {{8, 0.000788}, {12, 0.000246}, {16, 0.000232}})
      .measured("planes, 60 degrees", "band_in_linf_vx", {{8, 0.0206}, {12, 0.0118}, {16, 0.00958}})
      .measured("planes, 60 degrees", "band_out_linf_vx", {{8, 0.0203}, {12, 0.0121}, {16, 0.0094}})
      .measured("planes, 60 degrees", "surface_l1_vx", {{8, 0.00422}, {12, 0.00253}, {16, 0.0016}})
      .measured("planes, 90 degrees", "band_in_linf_vx",
                {{8, 0.0123}, {12, 0.00831}, {16, 0.00645}})
      .measured("planes, 90 degrees", "band_out_linf_vx", {{8, 0.013}, {12, 0.0084}, {16, 0.00636}})
      .measured("planes, 90 degrees", "surface_l1_vx",
                {{8, 0.00297}, {12, 0.00103}, {16, 0.000691}})
      .measured("planes, 60 degrees", "missed_hits", {{8, 0.000917}})
      .measured("planes, 90 degrees", "missed_hits", {{8, 0.000848}});
}

Bounds csgLawsBounds() {
  return Bounds()
      .zero("A ∪ A = A", "deviation_vx")
      .zero("A ∩ A = A", "deviation_vx")
      .zero("A ∪ B = B ∪ A", "deviation_vx")
      .zero("A ∩ B = B ∩ A", "deviation_vx")
      .zero("X \\ (A ∪ B) = (X \\ A) ∩ (X \\ B)", "deviation_vx")
      .zero("X \\ (A ∩ B) = (X \\ A) ∪ (X \\ B)", "deviation_vx");
}

}  // namespace

void addCsgCases(std::vector<Case>& all) {
  all.push_back({.name = "csg-balls",
                 .group = "CSG",
                 .title = "union, intersection and difference of two balls as distances",
                 .definition =
                     "Two spheres of radius 1 whose centres are (0.9, 0.3, 0.2) apart. The exact "
                     "distance is the distance to the nearest part of the two spheres or of the "
                     "circle between them. Volume and area follow from spherical caps. The band's "
                     "errors leave out grid points within 1.5 voxels of the circle.",
                 .citation = "closed form",
                 .quick = {12, 16, 32},
                 .full = {32, 64, 128, 256},
                 .bounds = csgBallsBounds(),
                 .run = combineBalls});
  all.push_back({.name = "csg-laws",
                 .group = "CSG laws",
                 .title = "idempotence, commutativity, De Morgan",
                 .definition = "A and B are the balls of csg-balls, X is a box of edge 4 around "
                               "them. deviation: largest difference between the bands of the two "
                               "sides of a law, in voxels. It must be exactly zero.",
                 .citation = "set algebra",
                 .quick = {8, 12, 16},
                 .full = {16, 32, 64},
                 .bounds = csgLawsBounds(),
                 .run = laws});
  all.push_back({.name = "smooth-csg-balls",
                 .group = "smooth CSG",
                 .title = "smooth union of two balls",
                 .definition =
                     "The centres of balls of radius 1 and 0.8 are (0.9, 0.3, 0.2) apart. Their "
                     "smooth union with K = 0.4 is the zero set of min(a, b) − max(K − |a − b|, "
                     "0)² / 4K of their distances a and b, a surface of revolution. The exact "
                     "distance is the distance to its profile curve.",
                 .citation = "Dekkers04, Quilez13",
                 .quick = {8, 16, 32},
                 .full = {16, 32, 64},
                 .bounds = smoothBallsBounds(),
                 .run = smoothlyUniteBalls});
  all.push_back({.name = "smooth-csg-planes",
                 .group = "smooth CSG",
                 .title = "smooth union of two half spaces",
                 .definition =
                     "Two half spaces leave 60°, 90° or 120° of free space between them; K = 0.4. "
                     "The section of the smooth union has a parabola between the two planes. "
                     "Points within 1 of the middle of the edge are compared.",
                 .citation = "Dekkers04, Quilez13",
                 .quick = {8, 12, 16},
                 .full = {16, 24, 32},
                 .bounds = smoothPlanesBounds(),
                 .run = smoothlyUnitePlanes});
}

}  // namespace regress
