#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/carried.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/advection/advect.h"
#include "levelset/advection/velocity.h"
#include "levelset/inspect/compare.h"

namespace regress {

using Imath::V3d;
using levelset::AdvectScheme;
using levelset::NarrowBand;
using levelset::VectorField;

namespace {

struct Scheme {
  const char* name;
  AdvectScheme scheme;
};
constexpr Scheme kSchemes[] = {{"front", AdvectScheme::Front},
                               {"semi-Lagrangian", AdvectScheme::SemiLagrangian}};

/// Returns the volume of the symmetric difference of two solids, over the volume of the exact
/// solid; 1 if `a` is empty.
double symmetricDifference(const NarrowBand& a, const NarrowBand& b, const Truth& truth) {
  if (a.isEmpty()) return 1;
  return levelset::compare(a, b).symmetricDifference / *truth.volume;
}

/// Velocity that returns a solid to its initial shape and position after `time`.
struct TimeInterval {
  VectorField velocity;
  double time;
  bool turnsBack;  ///< true: the velocity reverses its direction at half of `time`
};

/// Measures the advection of an exact band by all schemes, and by OpenVDB. value_error is the
/// volume of the symmetric difference of start and end over the exact volume.
/// @param finestPeer  finest resolution at which OpenVDB runs in the quick budget
void carry(Recorder& out, const std::string& variant, const Sample& at, const Truth& truth,
           const TimeInterval& journey, int finestPeer) {
  const NarrowBand solid = exactBand(truth, at.voxelSize);
  for (const Scheme& s : kSchemes) {
    if (out.isQuick() && s.scheme != AdvectScheme::Front && !out.wantsRepeats(at)) continue;
    const auto made = out.measure({variant + ", " + s.name, at, truth}, kOurs, [&] {
      return levelset::advect(solid, journey.velocity, journey.time, {.scheme = s.scheme}).band;
    });
    if (made) out.set("value_error", symmetricDifference(*made, solid, truth));
  }
  if (!out.wantsPeer(at, finestPeer, 1)) return;
  const auto theirs = out.measure({variant, at, truth}, peer::kAdvect, [&] {
    return peer::advect(solid, journey.velocity, journey.time, journey.turnsBack);
  });
  if (theirs) out.set("value_error", symmetricDifference(*theirs, solid, truth));
}

/// Measures the solid at half the time, T/2 = 1.5, against a reference whose points were moved one
/// by one, without a level set.
void halfWay(Recorder& out, const std::string& variant, const Sample& at, const NarrowBand& solid,
             const VectorField& velocity, const NarrowBand& reference) {
  for (const Scheme& s : kSchemes)
    out.measure(variant + " at T/2, " + s.name, at, reference, kOurs,
                [&] { return levelset::advect(solid, velocity, 1.5, {.scheme = s.scheme}).band; });
}

void enright(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const Truth truth = ball(V3d(0.35) + at.shift, 0.15);
    const NarrowBand solid = exactBand(truth, at.voxelSize);
    const VectorField velocity = levelset::enrightVelocity();
    carry(out, "function", at, truth, {velocity, 3, true}, 20);
    if (!out.wantsRepeats(at)) continue;
    const VectorField gridded = peer::staggered(velocity, at.voxelSize);
    const VectorField swinging = [=](const V3d& p, double t) {
      return gridded(p, 0) * std::cos(std::numbers::pi * t / 3);
    };
    carry(out, "staggered grid", at, truth, {swinging, 3, true}, 0);
    // Four advections of a quarter of the period T = 3 each; each starts from the band of the
    // previous one.
    const auto halting = out.measure({"stopped at quarters", at, truth}, kOurs, [&] {
      NarrowBand band = solid;
      for (int quarter = 0; quarter < 4; ++quarter)
        band = levelset::advect(band, velocity, 0.75, {.start = 0.75 * quarter}).band;
      return band;
    });
    if (halting) out.set("value_error", symmetricDifference(*halting, solid, truth));
    if (at.phase != kQuickPhase) continue;
    const NarrowBand reference =
        carriedBall(truth.centre, 0.15, velocity, 1.5, out.isQuick() ? 1.0 / 64 : 1.0 / 512);
    halfWay(out, "function", at, solid, velocity, reference);
    halfWay(out, "staggered grid", at, solid, swinging, reference);
    if (out.wantsPeer(at, 20))
      out.measure("function at T/2", at, reference, peer::kAdvect,
                  [&] { return peer::advect(solid, velocity, 1.5, false); });
  }
}

void vortex(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const double period = out.isQuick() ? 2 : 8;
    carry(out, "sphere", at, ball(V3d(0.5, 0.75, 0.5) + at.shift, 0.15),
          {levelset::vortexVelocity(period), period, true}, 16);
  }
}

/// Ball of radius 15 with a slot of width 5 from below up to y = 85, all lengths in hundredths of a
/// unit. The distance is exact inside. Outside, near the edges where sphere and slot meet almost at
/// right angles, its error is a few per cent.
Truth zalesakSphere(const V3d& centre) {
  Truth truth;
  truth.centre = centre;
  truth.reach = 0.15;
  truth.distance = [=](const V3d& p) {
    const V3d q = p - centre;
    const double a = q.length() - 0.15;
    // Distance to the slot |x| < 2.5, y < 10 about the centre, negative in the slot.
    const double x = std::abs(q.x) - 0.025, y = q.y - 0.10;
    const double slot =
        std::hypot(std::max(x, 0.0), std::max(y, 0.0)) + std::min(0.0, std::max(x, y));
    return a > 0 && slot < 0 ? std::hypot(a, slot) : std::max(a, -slot);
  };
  // Volume of the slot in the ball by the midpoint rule: the integral of the chord along z over |x|
  // < 2.5 and y < 10 hundredths.
  constexpr int kSteps = 2000;
  double volume = 0;
  const double dx = 0.05 / kSteps * 20, dy = 0.25 / kSteps;
  for (int i = 0; i < kSteps / 20; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double x = -0.025 + (i + 0.5) * dx, y = -0.15 + (j + 0.5) * dy;
      volume += 2 * std::sqrt(std::max(0.0, 0.0225 - x * x - y * y)) * dx * dy;
    }
  truth.volume = *ball(centre, 0.15).volume - volume;
  return truth;
}

void zalesak(Recorder& out) {
  for (const Sample& at : out.samples())
    carry(out, "slotted sphere", at, zalesakSphere(V3d(0.5, 0.75, 0.5) + at.shift),
          {levelset::rotationVelocity(V3d(0.5, 0.5, 0.5), V3d(0, 0, 1), 628), 628, false}, 24);
}

/// Measures the upwind scheme with all orders in space, each with Runge-Kutta steps of its order,
/// at most 3, on a ball of radius 0.4 that moves by its diameter. A full turn is too long for the
/// first order: the ball vanishes.
void compareOrders(Recorder& out, const Sample& at, const V3d& centre) {
  const V3d by(0.3, -0.4, 0.62);
  const NarrowBand solid = exactBand(ball(centre, 0.4), at.voxelSize);
  for (const int order : {1, 2, 3, 5})
    out.measure({fmt::format("ball, upwind of order {}", order), at, ball(centre + by, 0.4)}, kOurs,
                [&] {
                  return levelset::advect(solid, [by](const V3d&, double) { return by; }, 1,
                                          {.scheme = AdvectScheme::Upwind,
                                           .order = order,
                                           .timeOrder = std::min(order, 3)})
                      .band;
                });
}

void rotate(Recorder& out) {
  const TimeInterval turn{levelset::rotationVelocity(V3d(0), V3d(1, 2, 3), 1), 1, false};
  for (const Sample& at : out.samples()) {
    const V3d c = V3d(0.5, 0, 0) + at.shift;
    carry(out, "cube", at, box(c, V3d(0.6)), turn, 8);
    carry(out, "torus", at, torus(c, V3d(0, 0, 1), 0.35, 0.12), turn, 8);
    if (out.wantsRepeats(at) && at.phase == kQuickPhase) compareOrders(out, at, c);
    carry(out, "plate of two voxels", at, box(c, V3d(0.6, 0.6, 2 * at.voxelSize)), turn, 8);
  }
}

void badVelocities(Recorder& out) {
  const double h = 1.0 / 16;
  const NarrowBand solid = exactBand(ball(V3d(0.01, 0.02, 0.03), 1), h);
  out.expectRefusal("velocity of NaN", levelset::ExitCode::Input, [&] {
    (void)levelset::advect(
        solid, [](const V3d&, double) { return V3d(std::nan("")); }, 1);
  });
  out.expect(
      "velocity of 1e9 for 1e-9", "the sphere moved by 1, with the error as measured before", [&] {
        const NarrowBand made = levelset::advect(
                                    solid, [](const V3d&, double) { return V3d(1e9, 0, 0); }, 1e-9)
                                    .band;
        Figures figures;
        addErrors(made, ball(V3d(1.01, 0.02, 0.03), 1), Mesher::Ours, figures);
        const double error = figures["surface_linf_vx"];
        const double missed = figures["missed_hits"];
        return std::pair{
            isAsMeasured(error, 0.0107) && isAsMeasured(missed, 3.13e-4),
            fmt::format("surface L∞ {:.3g} voxels, {:.3g} of the hits missed", error, missed)};
      });
  // No scheme can follow this velocity for long: a step has thousands of turns, or the sheets that
  // wind up need too much memory.
  out.expectRefusal("velocity of 1e9 that winds up", levelset::ExitCode::Resource, [&] {
    (void)levelset::advect(
        solid, [](const V3d& p, double) { return V3d(-p.y, p.x, 0) * (1e9 * p.length2()); }, 1,
        {.maxMemory = std::size_t{256} << 20});
  });
  // The velocity jumps across x = 0.01, where the triangles of a front are stretched without limit.
  // The grid of the semi-Lagrangian scheme does not resolve this stretching.
  const VectorField jump = [](const V3d& p, double) { return V3d(0, p.x < 0.01 ? -1 : 1, 0); };
  out.expectRefusal("velocity with a jump, front", levelset::ExitCode::Resource,
                    [&] { (void)levelset::advect(solid, jump, 0.25); });
  out.expect(
      "velocity with a jump, semi-Lagrangian",
      "halves moved apart by 0.5, the volume error as measured before, a sound band", [&] {
        const NarrowBand made =
            levelset::advect(solid, jump, 0.25, {.scheme = AdvectScheme::SemiLagrangian}).band;
        Figures figures;
        addInvariants(made, ball(V3d(0), 1), figures);
        return std::pair{
            isAsMeasured(figures["volume_error"], 5.8e-4) && figures["checks_failed"] == 0,
            "volume " + std::to_string(100 * figures["volume_error"]) + " %"};
      });
}

Bounds enrightBounds() {
  return Bounds()
      .measured("function, front", "volume_error",
                {{20, 0.0184},
                 {24, 0.00989},
                 {28, 0.00783},
                 {32, 0.00576},
                 {64, 0.00139},
                 {128, 0.000331}})
      .measured("function, front", "value_error",
                {{20, 0.0198},
                 {24, 0.00986},
                 {28, 0.00779},
                 {32, 0.00574},
                 {64, 0.00137},
                 {128, 0.00033}})
      .measured(
          "function, front", "surface_l1_vx",
          {{20, 0.021}, {24, 0.0128}, {28, 0.0112}, {32, 0.00945}, {64, 0.00462}, {128, 0.00221}})
      .measured("staggered grid, front", "volume_error",
                {{20, 0.0146}, {32, 0.00575}, {64, 0.00145}, {128, 0.000336}})
      .measured("staggered grid, front", "value_error",
                {{20, 0.0155}, {32, 0.00599}, {64, 0.00159}, {128, 0.000371}})
      .measured("staggered grid, front", "surface_l1_vx",
                {{20, 0.0165}, {32, 0.01}, {64, 0.00558}, {128, 0.00256}})
      .measured("function, front", "missed_hits",
                {{20, 0.011}, {24, 0.00722}, {28, 0.00609}, {32, 0.00304}, {64, 0.0012}, {128, 0}})
      .measured("staggered grid, front", "missed_hits",
                {{20, 0.011}, {32, 0.00304}, {64, 0.0016}, {128, 0}})
      .measured("function at T/2, front", "value_error", {{20, 0.317}, {64, 0.076}, {128, 0.00461}})
      .measured("staggered grid at T/2, front", "value_error",
                {{20, 0.389}, {64, 0.0871}, {128, 0.00836}});
}

Bounds vortexBounds() {
  return Bounds()
      .measured("sphere, front", "volume_error",
                {{16, 0.0267}, {20, 0.0168}, {32, 0.00619}, {64, 0.00166}, {128, 0.000559}})
      .measured("sphere, front", "value_error",
                {{16, 0.026}, {20, 0.0164}, {32, 0.00643}, {64, 0.00235}, {128, 0.00106}})
      .measured("sphere, front", "surface_linf_vx",
                {{16, 0.0984}, {20, 0.0507}, {32, 0.057}, {64, 0.0297}, {128, 0.0304}})
      .measured("sphere, front", "missed_hits",
                {{16, 0.02},
                 {20, 0.00661},
                 {32, 0.00135, Budget::Quick},
                 {32, 0.00337, Budget::Full},
                 {64, 0.0012},
                 {128, 0.000585}})
      .ceiling(0.025);
}

/// Rays that pass within a fraction of a voxel of an edge of the slot may hit or miss the slot.
Bounds zalesakBounds() {
  return Bounds()
      .measured("slotted sphere, front", "surface_linf_vx",
                {{24, 0.545}, {32, 0.355}, {50, 0.6}, {100, 0.336}, {200, 0.312}})
      .measured("slotted sphere, front", "missed_hits",
                {{24, 0.162}, {32, 0.0691}, {50, 0.0532}, {100, 0.0177}, {200, 0.0076}})
      .ceiling(0.1666)
      .measured("slotted sphere, front", "volume_error",
                {{24, 0.138}, {32, 0.017}, {50, 0.018}, {100, 0.00337}, {200, 0.00154}});
}

/// The tube of the torus has a radius of one voxel at the coarsest resolution.
Bounds rigidRotationBounds() {
  return Bounds()
      .measured("cube, front", "surface_l1_vx",
                {{8, 0.0785}, {12, 0.0463}, {16, 0.0522}, {32, 0.0279}, {64, 0.0146}})
      .ceiling(0.1)
      .measured("torus, front", "surface_l1_vx",
                {{8, 0.0738}, {12, 0.0202}, {16, 0.0167}, {32, 0.00838}, {64, 0.00403}})
      .ceiling(0.1)
      .measured("plate of two voxels, front", "surface_l1_vx",
                {{8, 0.117}, {12, 0.0815}, {16, 0.0984}, {32, 0.0961}, {64, 0.1}})
      .ceiling(0.15)
      .measured("torus, front", "surface_linf_vx",
                {{8, 0.192}, {12, 0.0824}, {16, 0.0668}, {32, 0.0376}, {64, 0.0185}})
      .ceiling(0.2)
      .measured("cube, front", "missed_hits",
                {{8, 0.132}, {12, 0.066}, {16, 0.0777}, {32, 0.0328}, {64, 0.0154}})
      .ceiling(0.15, 8)
      .ceiling(0.075, 16)
      .ceiling(0.0375, 32)
      .measured("torus, front", "missed_hits",
                {{8, 0.0941}, {12, 0.0217}, {16, 0.00904}, {32, 0.00188}, {64, 0.000433}})
      .ceiling(0.1, 8)
      .ceiling(0.025, 12)
      .measured("plate of two voxels, front", "missed_hits",
                {{8, 0.216}, {12, 0.122}, {16, 0.0923}, {32, 0.0669}, {64, 0.0289}})
      .ceiling(0.225, 8)
      .ceiling(0.15, 12)
      .ceiling(0.1125, 16)
      .ceiling(0.0562, 32)
      .ceiling(0.0281, 64);
}

}  // namespace

void addAdvectionCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "enright",
       .group = "advection, Enright",
       .title = "a sphere is stretched to a sheet and returns",
       .definition =
           "Sphere of radius 0.15 at (0.35, 0.35, 0.35) in LeVeque's deformation with T = 3, the "
           "velocity given as a function and on a staggered grid of the same voxels. At time T the "
           "solid is the sphere again. value: volume of the symmetric difference of start and end, "
           "over the volume of the start. A run that stops and restarts from the band at every "
           "quarter of T has no bound. At T/2 the sheet is thinnest. The reference there is a band "
           "of 512 voxels per unit (64 in the quick budget), made from points of the sphere that "
           "are moved one by one. surface at T/2: mean and largest distance between result and "
           "reference, the larger of both directions.",
       .citation = "LeVeque96, Enright02",
       .quick = {20, 24, 28},
       .full = {32, 64, 128},
       .bounds = enrightBounds(),
       .run = enright});
  all.push_back(
      {.name = "vortex",
       .group = "advection, vortex",
       .title = "a sphere in a single vortex returns to its start",
       .definition =
           "Sphere of radius 0.15 at (0.5, 0.75, 0.5) in the vortex of the unit square; the period "
           "T is 8, in the quick budget 2. At time T the solid is the sphere again. value: volume "
           "of the symmetric difference of start and end, over the volume of the start.",
       .citation = "Bell89, LeVeque96",
       .quick = {16, 20, 32},
       .full = {32, 64, 128},
       .bounds = vortexBounds(),
       .run = vortex});
  all.push_back(
      {.name = "zalesak",
       .group = "advection, Zalesak",
       .title = "a slotted sphere turns once",
       .definition =
           "Sphere of radius 15 at (50, 75, 50) with a slot of width 5 up to y = 85, all lengths "
           "in hundredths of a unit. It turns once about (50, 50) in the time 628. value: volume "
           "of the symmetric difference of start and end, over the volume of the start.",
       .citation = "Zalesak79, Enright02",
       .quick = {24, 32, 50},
       .full = {50, 100, 200},
       .bounds = zalesakBounds(),
       .run = zalesak});
  all.push_back({.name = "rigid-rotation",
                 .group = "advection, rotation",
                 .title = "cube, torus and thin plate turn once",
                 .definition =
                     "A cube of edge 0.6, a torus (ring radius 0.35, tube radius 0.12) and a plate "
                     "two voxels thick are half a unit from the origin and turn once about the "
                     "axis (1, 2, 3) through it. A ball of radius 0.4 moves by (0.3, -0.4, 0.62) "
                     "with the upwind scheme of each order; it has no bound. value: volume of the "
                     "symmetric difference of "
                     "start and end, over the volume of the start.",
                 .citation = "closed form",
                 .quick = {8, 12, 16},
                 .full = {16, 32, 64},
                 .bounds = rigidRotationBounds(),
                 .run = rotate});
  all.push_back({.name = "bad-velocities",
                 .group = "bad-velocities",
                 .title = "velocities of 1e9, of NaN, with a jump",
                 .definition = "Velocities that input files or programs can contain.",
                 .citation = "stated outcomes",
                 .run = badVelocities});
}

}  // namespace regress
