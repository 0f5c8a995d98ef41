#include <array>
#include <cmath>
#include <limits>

#include "apps/process_cost.h"
#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "apps/regress/truth/gaps.h"
#include "apps/regress/truth/golden_section.h"
#include "levelset/distance/closest_points.h"
#include "levelset/eikonal/arrival.h"
#include "levelset/fields/grid_vdb.h"

namespace regress {

using Imath::V3d;
using levelset::ArrivalOptions;
using levelset::FrontMethod;
using levelset::NarrowBand;

namespace {

struct Front {
  const char* name;
  FrontMethod method;
  int order;
};
constexpr std::array<Front, 4> kFronts = {{{"marching, order 1", FrontMethod::Marching, 1},
                                           {"marching, order 2", FrontMethod::Marching, 2},
                                           {"sweeping, order 1", FrontMethod::Sweeping, 1},
                                           {"sweeping, order 2", FrontMethod::Sweeping, 2}}};

/// Returns the region that a front from a point must have reached at the time `until`. The last
/// `margin` voxels, as times at speed 1, are left out.
/// @param fastest, slowest  largest and smallest speed in the region
Region reachedRegion(const Distance& exact, double until, const Sample& at, double margin,
                     double fastest, double slowest) {
  return {.value = exact,
          .low = -1,
          .high = until - margin * at.voxelSize,
          .steepest = 1 / slowest,
          .centre = at.shift,
          .extent = until * fastest};
}

/// Returns the errors of arrival times at active grid points, as distances at speed 1, and the
/// share of the region's grid points without a time.
Figures timeErrors(const levelset::FieldGrid& times, const Region& region, double voxelSize) {
  double sum = 0, largest = 0, count = 0;
  const openvdb::FloatGrid& grid = *times.shared()->scalar;
  for (auto it = grid.cbeginValueOn(); it; ++it) {
    const double error =
        std::abs(static_cast<double>(*it) -
                 region.value(levelset::toImath(grid.indexToWorld(it.getCoord()))));
    sum += error;
    largest = std::max(largest, error);
    ++count;
  }
  return {{"voxel_size", voxelSize},
          {"active_voxels", count},
          {"missing_band", missingShare(region, grid)},
          {"band_out_l1", sum / count},
          {"band_out_linf", largest},
          {"band_out_l1_vx", sum / count / voxelSize},
          {"band_out_linf_vx", largest / voxelSize}};
}

void measureTimes(Recorder& out, const std::string& variant, const Sample& at, const Region& region,
                  const std::function<levelset::ArrivalTimes()>& work) {
  std::optional<levelset::ArrivalTimes> made;
  const apps::Cost cost = apps::costOf([&] { made = work(); });
  Figures figures = timeErrors(made->times, region, at.voxelSize);
  figures["cpu_s"] = cost.cpuSeconds;
  figures["peak_bytes"] = cost.peakBytes;
  out.row(variant, kOurs, at, std::move(figures));
}

void fromPoint(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const NarrowBand lattice = exactBand(ball(V3d(0), 0.3), at.voxelSize);
    const std::array<V3d, 1> source{at.shift};
    const Region reached =
        reachedRegion([&](const V3d& p) { return (p - at.shift).length(); }, 1, at, 1, 1, 1);
    for (const Front& front : kFronts)
      measureTimes(out, front.name, at, reached, [&] {
        return levelset::arrivalTimesFromPoints(lattice, source, 1,
                                                {.method = front.method, .order = front.order});
      });
  }
}

/// Measures fronts at the speed 1 + g·(p − source), where rays are arcs of circles.
void fromPointWithGradient(Recorder& out) {
  const V3d slope(0.5, 0.3, 0.2);
  for (const Sample& at : out.samples()) {
    const NarrowBand lattice = exactBand(ball(V3d(0), 0.3), at.voxelSize);
    const std::array<V3d, 1> source{at.shift};
    const auto speed = [&](const V3d& p) { return 1 + slope.dot(p - at.shift); };
    const Distance exact = [&](const V3d& p) {
      return std::acosh(1 + slope.length2() * (p - at.shift).length2() / (2 * speed(p))) /
             slope.length();
    };
    // In the direction of g the front advances by (exp(0.8 |g|) − 1) / |g| = 1.03 until the time
    // 0.8. Against g it reaches points where the speed is 0.61; the blocks around these points
    // extend to a speed of 0.35.
    const Region reached = reachedRegion(exact, 0.8, at, 1, 1.3, 0.35);
    for (const Front& front : kFronts) {
      const ArrivalOptions options{.method = front.method, .order = front.order, .speed = speed};
      measureTimes(out, front.name, at, reached,
                   [&] { return levelset::arrivalTimesFromPoints(lattice, source, 0.8, options); });
    }
  }
}

/// Shortest travel time from a source at z = −`depth` in two media. The speed is 1 below the plane
/// z = 0 and `speed` above it. The fastest path crosses the plane where Snell's law holds. The time
/// is convex in the crossing point, so golden section finds that point. A faster medium above the
/// plane sends a head wave back below it.
double quickest(double away, double z, double depth, double speed) {
  const auto shortest = [&](const auto& cost) {
    constexpr int kSteps = 40;
    return cost(goldenSectionMinimum(cost, 0, away, kSteps));
  };
  if (z > 0)
    return shortest([&](double x) {
      return std::sqrt(x * x + depth * depth) + std::sqrt((away - x) * (away - x) + z * z) / speed;
    });
  const double direct = std::hypot(away, z + depth);
  if (speed <= 1) return direct;
  // The head wave meets the plane at the critical angle, follows the plane, and leaves it downwards
  // at the same angle.
  const double cosine = std::sqrt(1 - 1 / (speed * speed)), tangent = 1 / (speed * cosine);
  const double along = away - (depth - z) * tangent;
  return along < 0 ? direct : std::min(direct, (depth - z) / cosine + along / speed);
}

void throughMedia(Recorder& out) {
  constexpr double kDepth = 0.25, kUntil = 0.6;
  for (const Sample& at : out.samples()) {
    const NarrowBand lattice = exactBand(ball(V3d(0), 0.3), at.voxelSize);
    const std::array<V3d, 1> source{at.shift - V3d(0, 0, kDepth)};
    for (const double speed : {0.5, 2.0}) {
      const Distance exact = [&](const V3d& p) {
        const V3d q = p - at.shift;
        return quickest(std::hypot(q.x, q.y), q.z, kDepth, speed);
      };
      // A margin of two voxels exceeds the error of the arrival times.
      Region reached =
          reachedRegion(exact, kUntil, at, 2, std::max(1.0, speed), std::min(1.0, speed));
      reached.centre = source[0];
      for (const Front& front : kFronts) {
        ArrivalOptions options{.method = front.method, .order = front.order};
        options.speed = [&](const V3d& p) { return p.z > at.shift.z ? speed : 1.0; };
        measureTimes(
            out, std::string(speed < 1 ? "slow" : "fast") + " beyond, " + front.name, at, reached,
            [&] { return levelset::arrivalTimesFromPoints(lattice, source, kUntil, options); });
      }
    }
  }
}

void fromSurface(Recorder& out) {
  for (const Sample& at : out.samples()) {
    // The fronts extend a band of three voxels by eight, as OpenVDB's dilateSdf does below.
    const double reach = 11 * at.voxelSize;
    const auto measure = [&](const std::string& name, const Truth& truth) {
      const NarrowBand solid = exactBand(truth, at.voxelSize);
      for (const Front& front : kFronts)
        out.measure({name + ", " + front.name, at, truth}, kOurs, [&] {
          return levelset::frontDistance(solid, reach,
                                         {.method = front.method, .order = front.order})
              .band;
        });
      if (out.wantsPeer(at, 12))
        out.measure({name, at, truth}, peer::kDilate, [&] { return peer::dilate(solid, 8); });
    };
    measure("sphere", ball(at.shift, 1));
    // The fronts of the two spheres meet halfway, where the distance has a crease.
    measure("two spheres", apart(ball(at.shift, 0.6), ball(at.shift + V3d(1.3, 0.2, 0.1), 0.6)));
  }
}

void closest(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const auto measure = [&](const std::string& name, const Truth& truth, const auto& foot) {
      const NarrowBand solid = exactBand(truth, at.voxelSize);
      std::optional<levelset::FieldGrid> made;
      const apps::Cost cost = apps::costOf([&] { made = levelset::closestPoints(solid); });
      double offSurface = 0, sum = 0, astray = 0, count = 0;
      const openvdb::Vec3SGrid& grid = *made->shared()->vector;
      for (auto it = grid.cbeginValueOn(); it; ++it) {
        const V3d point = levelset::toImath(openvdb::Vec3d(*it));
        const V3d p = levelset::toImath(grid.indexToWorld(it.getCoord()));
        const double error = std::abs(truth.distance(point));
        offSurface = std::max(offSurface, error);
        sum += error;
        astray = std::max(astray, (point - foot(p)).length());
        ++count;
      }
      out.row(
          name, kOurs, at,
          {{"voxel_size", at.voxelSize},
           {"active_voxels", count},
           {"missing_band", missingShare(bandRegion(truth, solid.halfWidth(), at.voxelSize), grid)},
           {"surface_l1", sum / count},
           {"surface_linf", offSurface},
           {"surface_l1_vx", sum / count / at.voxelSize},
           {"surface_linf_vx", offSurface / at.voxelSize},
           {"value_error", astray / at.voxelSize},
           {"cpu_s", cost.cpuSeconds},
           {"peak_bytes", cost.peakBytes}});
    };
    const V3d c = at.shift;
    measure("sphere", ball(c, 1), [&](const V3d& p) { return c + (p - c).normalized(); });
    measure("torus", torus(c, V3d(0, 0, 1), 0.7, 0.3), [&](const V3d& p) {
      const V3d q = p - c;
      const V3d ring = V3d(q.x, q.y, 0).normalized() * 0.7;
      return c + ring + (q - ring).normalized() * 0.3;
    });
  }
}

Bounds eikonalPointBounds() {
  return Bounds()
      .measured("marching, order 2", "band_out_linf_vx",
                {{12, 2.78e-6}, {16, 2.9e-6}, {32, 1.14e-5}, {64, 3.9e-5}})
      .rounding("marching, order 2", "band_out_linf_vx", 5, 6)
      .rounding("marching, order 2", "band_out_linf_vx", 3, 8)
      .measured("sweeping, order 2", "band_out_linf_vx",
                {{12, 2.78e-6}, {16, 2.9e-6}, {32, 1.14e-5}, {64, 3.9e-5}})
      .rounding("sweeping, order 2", "band_out_linf_vx", 5, 6)
      .rounding("sweeping, order 2", "band_out_linf_vx", 3, 8);
}

Bounds eikonalGradientBounds() {
  return Bounds()
      .measured("marching, order 2", "band_out_linf_vx",
                {{8, 0.0306}, {12, 0.045}, {16, 0.0395}, {32, 0.0148}, {64, 0.0158}})
      .measured("sweeping, order 2", "band_out_linf_vx",
                {{8, 0.0318}, {12, 0.0463}, {16, 0.0407}, {32, 0.0173}, {64, 0.0156}})
      .order("marching, order 2", "order_band_l1", {{64, 2.20}})
      .order("sweeping, order 2", "order_band_l1", {{64, 2.21}});
}

Bounds eikonalMediaBounds() {
  return Bounds()
      .measured("slow beyond, marching, order 2", "band_out_linf_vx",
                {{12, 0.524}, {16, 0.511}, {24, 0.522}, {32, 0.601}, {64, 0.639}, {128, 0.659}})
      .measured("slow beyond, sweeping, order 2", "band_out_linf_vx",
                {{12, 0.524}, {16, 0.511}, {24, 0.522}, {32, 0.601}, {64, 0.639}, {128, 0.659}})
      .measured("fast beyond, marching, order 2", "band_out_linf_vx",
                {{12, 1.14}, {16, 0.242}, {24, 0.244}, {32, 1.27}, {64, 1.26}, {128, 1.24}})
      .ceiling(1.5)
      .measured("fast beyond, sweeping, order 2", "band_out_linf_vx",
                {{12, 1.15}, {16, 0.242}, {24, 0.244}, {32, 1.27}, {64, 1.26}, {128, 1.24}})
      .ceiling(1.5);
}

Bounds eikonalSurfaceBounds() {
  return Bounds()
      .measured(
          "sphere, marching, order 2", "band_out_linf_vx",
          {{8, 0.0387}, {12, 0.0245}, {16, 0.0168}, {24, 0.00937}, {32, 0.00596}, {64, 0.00182}})
      .ceiling(0.05)
      .measured(
          "sphere, sweeping, order 2", "band_out_linf_vx",
          {{8, 0.0387}, {12, 0.0245}, {16, 0.0187}, {24, 0.00937}, {32, 0.00834}, {64, 0.00554}})
      .ceiling(0.05)
      .measured("two spheres, sweeping, order 2", "band_out_linf_vx",
                {{8, 0.115}, {12, 0.0818}, {16, 0.0798}, {24, 0.0721}, {32, 0.0824}, {64, 0.0733}})
      .ceiling(0.15)
      .measured("two spheres, marching, order 2", "band_out_linf_vx",
                {{8, 0.111}, {12, 0.0792}, {16, 0.0769}, {24, 0.0721}, {32, 0.0629}, {64, 0.053}})
      .ceiling(0.15)
      .measured("sphere, marching, order 2", "band_in_linf_vx",
                {{8, 0.389}, {12, 0.218}, {16, 0.0706}, {24, 0.0194}, {32, 0.00909}, {64, 0.00179}})
      .ceiling(0.5)
      .measured("sphere, sweeping, order 2", "band_in_linf_vx",
                {{8, 0.389}, {12, 0.218}, {16, 0.0706}, {24, 0.0194}, {32, 0.00909}, {64, 0.00179}})
      .ceiling(0.5)
      .measured("two spheres, marching, order 2", "band_in_linf_vx",
                {{8, 0.379}, {12, 0.293}, {16, 0.402}, {24, 0.104}, {32, 0.0377}, {64, 0.00582}})
      .ceiling(0.5)
      .measured("two spheres, sweeping, order 2", "band_in_linf_vx",
                {{8, 0.379}, {12, 0.293}, {16, 0.402}, {24, 0.104}, {32, 0.0377}, {64, 0.00582}})
      .ceiling(0.5);
}

Bounds closestPointBounds() {
  return Bounds()
      .measured("sphere", "surface_linf_vx",
                {{8, 0.000934},
                 {12, 0.000407},
                 {16, 0.000226},
                 {24, 9.81e-5},
                 {32, 5.56e-5},
                 {64, 1.75e-5}})
      .ceiling(0.001)
      .measured(
          "sphere", "value_error",
          {{8, 0.0151}, {12, 0.0056}, {16, 0.00296}, {24, 0.00123}, {32, 0.000692}, {64, 0.000253}})
      .zero("sphere", "missing_band")
      .zero("torus", "missing_band")
      .order("torus", "order_surface", {{32, 3.14}});
}

}  // namespace

void addEikonalCases(std::vector<Case>& all) {
  all.push_back({.name = "eikonal-point",
                 .group = "eikonal, point source",
                 .title = "arrival times from a point",
                 .definition =
                     "|∇T| = 1 from one point between the grid points, out to T = 1. The "
                     "singularity at the source gives first-order schemes an error of O(h log h). "
                     "The second-order schemes factor the singularity out and keep their order.",
                 .citation = "Sethian99, Zhao05, Treister16",
                 .quick = {6, 8, 12},
                 .full = {16, 32, 64},
                 .bounds = eikonalPointBounds(),
                 .run = fromPoint});
  all.push_back({.name = "eikonal-gradient",
                 .group = "eikonal, gradient",
                 .title = "arrival times from a point where the speed is linear",
                 .definition =
                     "F = 1 + (0.5, 0.3, 0.2)·(x − s) from one point s between the grid points, up "
                     "to T = 0.8. The exact time is T = acosh(1 + |g|² |x − s|² / (2 F)) / |g|.",
                 .citation = "Treister16",
                 .quick = {8, 12, 16},
                 .full = {16, 32, 64},
                 .bounds = eikonalGradientBounds(),
                 .run = fromPointWithGradient});
  all.push_back(
      {.name = "eikonal-media",
       .group = "eikonal, two media",
       .title = "slower and faster media beyond a plane",
       .definition =
           "A point source lies 0.25 below a plane. The speed is 1 below the plane and 0.5 or 2 "
           "above it; times go up to T = 0.6. The exact times follow from Fermat's principle: rays "
           "refracted by Snell's law, and the head wave that a faster medium sends back.",
       .citation = "Sethian99, Zhao05",
       .quick = {12, 16, 24},
       .full = {32, 64, 128},
       .bounds = eikonalMediaBounds(),
       .run = throughMedia});
  all.push_back(
      {.name = "eikonal-surface",
       .group = "eikonal, from a surface",
       .title = "bands of one and of two spheres, extended by fronts by eight voxels",
       .definition =
           "The exact band, half width 3, of a sphere of radius 1, and of two spheres of radius "
           "0.6 whose fronts meet, is extended by eight voxels to a half width of eleven.",
       .citation = "Sethian99, Zhao05",
       .quick = {8, 12, 24},
       .full = {16, 32, 64},
       .bounds = eikonalSurfaceBounds(),
       .run = fromSurface});
  all.push_back({.name = "closest-point",
                 .group = "closest point",
                 .title = "closest points of a sphere and a torus",
                 .definition =
                     "Closest points at the grid points of a band. surface: exact distance of the "
                     "computed closest points to the surface. value: largest distance of a "
                     "computed closest point to the exact one, voxels.",
                 .citation = "Chopp01, Saye14",
                 .quick = {8, 12, 24},
                 .full = {16, 32, 64},
                 .bounds = closestPointBounds(),
                 .run = closest});
}

}  // namespace regress
