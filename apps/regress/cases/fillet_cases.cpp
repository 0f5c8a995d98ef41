#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/process_cost.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/csg/blend.h"
#include "levelset/csg/csg.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"
#include "levelset/vdb.h"

namespace regress {

using Imath::M44d;
using Imath::V3d;
using levelset::NarrowBand;

namespace {

/// Two slabs whose faces meet along z, at a corner. In coordinates relative to the corner, the free
/// space between them has the angle θ and is symmetric to y = 0: x > |y| / tan(θ/2).
struct Wedge {
  double half;  ///< θ / 2
  Truth first, second;
};

Wedge wedge(double degrees, const V3d& corner, double size) {
  const double half = degrees / 2 * std::numbers::pi / 180;
  const auto slab = [&](double side) {
    // Box whose face y = 0 is turned about z by ±θ/2 and moved to the corner; far larger than the
    // fillet.
    M44d turn, shift;
    turn.setAxisAngle(V3d(0, 0, 1), side * half);
    shift.setTranslation(corner);
    return moved(box(V3d(0, side * size / 2, 0), V3d(2 * size, size, 2 * size)), turn * shift);
  };
  return {half, slab(1), slab(-1)};
}

/// Finds the distance from the centre `from` of the fillet's circle to the surface along a
/// direction. NaN if the surface is not within `reach` of the expected distance.
double crossing(const levelset::BandSampler& phi, const V3d& from, const V3d& direction,
                double expected, double reach) {
  double low = expected - reach, high = expected + reach;
  const auto at = [&](double t) { return phi.value(from + t * direction); };
  if (!(at(low) > 0) || !(at(high) < 0)) return std::nan("");
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (at(middle) > 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Returns the largest relative error of the fillet's radius over its arc, on several sections
/// across the edge. NaN if the surface is not found.
double radiusError(const NarrowBand& band, const Wedge& w, const V3d& corner, double radius) {
  const levelset::BandSampler phi(band, levelset::Interpolation::Tricubic);
  const V3d centre = corner + V3d(radius / std::sin(w.half), 0, 0);
  const double spread = 0.9 * (std::numbers::pi / 2 - w.half);
  double worst = 0;
  for (int section = -2; section <= 2; ++section)
    for (int i = -8; i <= 8; ++i) {
      const double angle = spread * i / 8;
      const V3d from = centre + V3d(0, 0, 1.3 * band.voxelSize() * section);
      const double found = crossing(phi, from, V3d(-std::cos(angle), std::sin(angle), 0), radius,
                                    2 * band.voxelSize());
      if (std::isnan(found)) return std::nan("");
      worst = std::max(worst, std::abs(found / radius - 1));
    }
  return worst;
}

/// Returns the largest change of φ by the blend, in voxels, at grid points whose closest point on
/// the surface is further than `reach` from the edge.
double changeBeyond(const NarrowBand& blended, const NarrowBand& plain, const V3d& corner,
                    double reach) {
  constexpr double kMargin = 0.1;  // added to `reach`, voxels
  const levelset::BandSampler before(plain, levelset::Interpolation::Tricubic);
  const openvdb::FloatGrid& grid = levelset::vdb(blended);
  double largest = 0;
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    const V3d p = levelset::toImath(grid.indexToWorld(it.getCoord()));
    const double value = before.value(p);
    if (std::abs(value) >= plain.halfWidth() * plain.voxelSize() || !before.isInBand(p)) continue;
    const V3d foot = p - before.normal(p) * value - corner;
    const double away = std::hypot(foot.x, foot.y);
    // Points within `reach` of the edge at the corner are skipped, and points near the other edges
    // of the slabs.
    if (away < reach + kMargin * blended.voxelSize() || away > 3.5 || std::abs(foot.z) > 2)
      continue;
    largest = std::max(largest, std::abs(static_cast<double>(*it) - value));
  }
  return largest / blended.voxelSize();
}

void roundWedges(Recorder& out) {
  for (const Sample& at : out.samples()) {
    // The resolution counts voxels per radius of the fillet.
    const double radius = 1, h = at.voxelSize;
    for (const double degrees : {45.0, 90.0, 135.0}) {
      if (degrees != 90 && out.isQuick() && at.phase != kQuickPhase) continue;
      const Wedge w = wedge(degrees, at.shift, 4);
      const NarrowBand a = exactBand(w.first, h), b = exactBand(w.second, h);
      const NarrowBand plain = levelset::unite(a, b);
      NarrowBand made;
      const apps::Cost cost = apps::costOf([&] {
        made = levelset::blend(levelset::CsgOperation::Union, a, b, radius,
                               {.method = levelset::BlendMethod::Fillet})
                   .band;
      });
      const double beyond = radius / std::tan(w.half);
      out.row(fmt::format("{:.0f} degrees", degrees), kOurs, at,
              {{"voxel_size", h},
               {"value_error", radiusError(made, w, at.shift, radius)},
               {"deviation_vx", changeBeyond(made, plain, at.shift, beyond)},
               {"active_voxels", static_cast<double>(made.activeVoxelCount())},
               {"cpu_s", cost.cpuSeconds},
               {"peak_bytes", cost.peakBytes}});
    }
  }
}

/// Returns the largest relative error of the fillet's radius r between crossed cylinders of radius
/// R, with axes along x and y through one point. NaN if the surface is not found. A ball that
/// touches both cylinders from outside rolls along the ellipses |x| = |y|, x² + z² = (R + r)².
double crossedError(const NarrowBand& band, const V3d& centre, double cylinderRadius,
                    double radius) {
  const levelset::BandSampler phi(band, levelset::Interpolation::Tricubic);
  const double sum = cylinderRadius + radius;
  double worst = 0;
  for (int i = -6; i <= 6; ++i) {
    const double angle = 0.12 * i;  // parameter of the ellipse; 0 in the plane z = 0
    const V3d s(sum * std::cos(angle), sum * std::cos(angle), sum * std::sin(angle));
    // Directions from the centre of the rolling ball to the axes of the cylinders; the ball touches
    // the cylinders in these directions.
    const V3d toFirst = V3d(0, -s.y, -s.z).normalized(), toSecond = V3d(-s.x, 0, -s.z).normalized();
    for (const double t : {0.25, 0.5, 0.75}) {
      const V3d direction = (toFirst * (1 - t) + toSecond * t).normalized();
      const double found = crossing(phi, centre + s, direction, radius, 2 * band.voxelSize());
      if (std::isnan(found)) return std::nan("");
      worst = std::max(worst, std::abs(found / radius - 1));
    }
  }
  return worst;
}

void roundCylinders(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const double h = at.voxelSize, cylinderRadius = 1.5, radius = 1;
    const NarrowBand a = exactBand(cylinder(at.shift, V3d(1, 0, 0), cylinderRadius, 10), h),
                     b = exactBand(cylinder(at.shift, V3d(0, 1, 0), cylinderRadius, 10), h);
    NarrowBand made;
    const apps::Cost cost = apps::costOf([&] {
      made = levelset::blend(levelset::CsgOperation::Union, a, b, radius,
                             {.method = levelset::BlendMethod::Fillet})
                 .band;
    });
    double failed = 0;
    for (const levelset::CheckItem& item : levelset::check(made).items) failed += !item.passed;
    out.row("crossed cylinders", kOurs, at,
            {{"voxel_size", h},
             {"value_error", crossedError(made, at.shift, cylinderRadius, radius)},
             {"checks_failed", failed},
             {"cavities", static_cast<double>(levelset::measure(made).cavities)},
             {"active_voxels", static_cast<double>(made.activeVoxelCount())},
             {"cpu_s", cost.cpuSeconds},
             {"peak_bytes", cost.peakBytes}});
  }
}

void roundBalls(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const double h = at.voxelSize, radius = 0.5;
    const V3d other = at.shift + V3d(1.1, 0.3, 0.2);
    const Truth truth = filletedBalls(at.shift, 1, other, 0.7, radius);
    const NarrowBand a = exactBand(ball(at.shift, 1), h), b = exactBand(ball(other, 0.7), h);
    out.measure({"balls", at, truth}, kOurs, [&] {
      return levelset::blend(levelset::CsgOperation::Union, a, b, radius,
                             {.method = levelset::BlendMethod::Fillet})
          .band;
    });
  }
}

Bounds filletPlanesBounds() {
  return Bounds()
      .measured("45 degrees", "value_error",
                {{2, 0.00687},
                 {3, 0.00393},
                 {4, 0.00158, Budget::Quick},
                 {4, 0.00187, Budget::Full},
                 {8, 0.00012}})
      .measured("90 degrees", "value_error",
                {{2, 0.00688},
                 {3, 0.000967},
                 {4, 0.000806, Budget::Quick},
                 {4, 0.00168, Budget::Full},
                 {8, 0.00026}})
      .measured("135 degrees", "value_error",
                {{2, 0.00932},
                 {3, 0.00281},
                 {4, 0.00215, Budget::Quick},
                 {4, 0.00215, Budget::Full},
                 {8, 0.000371}})
      .rounding("45 degrees", "deviation_vx", 0.5)
      .rounding("90 degrees", "deviation_vx", 0.5)
      .rounding("135 degrees", "deviation_vx", 0.5);
}

Bounds filletCylindersBounds() {
  return Bounds()
      .measured("crossed cylinders", "value_error",
                {{3, 0.0042},
                 {4, 0.000835, Budget::Quick},
                 {4, 0.00177, Budget::Full},
                 {5, 0.000325},
                 {8, 0.00015},
                 {16, 1.66e-5}})
      .zero("crossed cylinders", "checks_failed")
      .zero("crossed cylinders", "cavities");
}

Bounds filletBallsBounds() {
  return Bounds()
      .measured("balls", "band_in_linf_vx",
                {{10, 0.000894},
                 {14, 0.00049},
                 {16, 0.000436},
                 {20, 0.000186},
                 {24, 0.000174},
                 {32, 0.000119}})
      .measured("balls", "band_out_linf_vx",
                {{10, 0.000844},
                 {14, 0.000457},
                 {16, 0.00038},
                 {20, 0.000204},
                 {24, 0.000157},
                 {32, 0.000109}})
      .measured("balls", "surface_l1_vx",
                {{10, 0.000629},
                 {14, 0.00031},
                 {16, 0.000226},
                 {20, 0.000139},
                 {24, 0.0001},
                 {32, 5.85e-5}})
      .measured(
          "balls", "surface_linf_vx",
          {{10, 0.0142}, {14, 0.00889}, {16, 0.0086}, {20, 0.00677}, {24, 0.00548}, {32, 0.00428}})
      .measured("balls", "volume_error", {{10, 9.3e-6}, {14, 1.15e-6}})
      .rounding("balls", "volume_error", 7, 16)
      .rounding("balls", "volume_error", 1, 20)
      .rounding("balls", "volume_error", 3, 24)
      .rounding("balls", "volume_error", 0.5, 32)
      .measured("balls", "missed_hits", {{16, 0.000267}, {24, 0.000245}});
}

}  // namespace

void addFilletCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "fillet-planes",
       .group = "fillets",
       .title = "the fillet between planes at 45°, 90° and 135°",
       .definition =
           "Two slabs enclose the angle θ of free space; their union is rounded with radius r = 1, "
           "so the resolution is in voxels per radius. value: largest relative error of the radius "
           "over the arc. deviation: change of φ beyond r / tan(θ/2) from the edge, voxels.",
       .citation = "closed form; Rossignac84",
       .quick = {2, 3, 4},
       .full = {4, 8, 16},
       .bounds = filletPlanesBounds(),
       .run = roundWedges});
  all.push_back({.name = "fillet-cylinders",
                 .group = "fillets of cylinders",
                 .title = "the fillet between crossed cylinders",
                 .definition =
                     "Cylinders of radius 1.5 along x and y, their union rounded with radius 1. "
                     "The ball of the fillet rolls along two ellipses. value: largest relative "
                     "error of the radius along the middle part of one ellipse; cavities: no void "
                     "may remain between the fillet and the seam.",
                 .citation = "closed form; Rossignac84",
                 .quick = {3, 4, 5},
                 .full = {4, 8, 16},
                 .bounds = filletCylindersBounds(),
                 .run = roundCylinders});
  all.push_back(
      {.name = "fillet-balls",
       .group = "fillets of balls",
       .title = "the fillet between two balls, and the distances of its band",
       .definition =
           "Balls of radius 1 and 0.7 whose centres are 1.16 apart, their union rounded with "
           "radius 0.5: a solid of revolution, in whose profile the arc of the fillet joins the "
           "arcs of the balls. The resolution is in voxels per radius of the larger ball.",
       .citation = "closed form; Rossignac84",
       .quick = {10, 14, 20},
       .full = {16, 24, 32},
       .bounds = filletBallsBounds(),
       .run = roundBalls});
}

}  // namespace regress
