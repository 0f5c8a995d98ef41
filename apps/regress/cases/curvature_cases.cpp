#include <fmt/core.h>

#include <cmath>

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/csg/csg.h"
#include "levelset/curvature/curvature_flow.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"

namespace regress {

using Imath::V3d;
using levelset::CurvatureFlowOptions;
using levelset::FlowScheme;
using levelset::NarrowBand;

namespace {

struct Integrator {
  const char* name;
  FlowScheme scheme;
};
constexpr Integrator kIntegrators[] = {{"auto", FlowScheme::Auto},
                                       {"explicit", FlowScheme::Explicit},
                                       {"stabilized", FlowScheme::Stabilized},
                                       {"implicit", FlowScheme::Implicit}};
/// Those that are stable at any length of step; explicit steps are cut.
constexpr Integrator kUnlimited[] = {kIntegrators[2], kIntegrators[3]};

std::string asLongAsTheBand(const Integrator& i) {
  return std::string(i.name) + ", steps as long as the band";
}

/// The longest step of explicit Euler, voxels².
constexpr double kExplicitStep = 0.16;

/// Steps of 1000 explicit ones, however much they err.
CurvatureFlowOptions longSteps(FlowScheme scheme, double voxelSize) {
  return {.scheme = scheme,
          .tolerance = 1000 * voxelSize,
          .step = 1000 * kExplicitStep * voxelSize * voxelSize};
}

/// value: mean distance of the surface from the exact one over the radius.
void shrinkSphere(Recorder& out) {
  constexpr double kTime = (1 - 0.25) / 4;  // R² = R0² − 4 t, to half the radius
  for (const Sample& at : out.samples()) {
    const NarrowBand solid = exactBand(ball(at.shift, 1), at.voxelSize);
    const Truth truth = ball(at.shift, 0.5);
    const auto measure = [&](const std::string& variant, const char* tool, const auto& work) {
      const std::optional<NarrowBand> made = out.measure({variant, at, truth}, tool, work);
      if (made) out.set("value_error", out.newest("surface_l1") / 0.5);
    };
    for (const Integrator& i : kIntegrators) {
      if (i.scheme != FlowScheme::Auto && out.isQuick() && at.phase != kQuickPhase) continue;
      measure(i.name, kOurs,
              [&] { return levelset::curvatureFlow(solid, kTime, {.scheme = i.scheme}).band; });
    }
    // The ball would be gone within one of them: they end where the surface leaves the band.
    for (const Integrator& i : kUnlimited) {
      if (out.isQuick() && at.phase != kQuickPhase) continue;
      measure(asLongAsTheBand(i), kOurs, [&] {
        return levelset::curvatureFlow(solid, kTime, longSteps(i.scheme, at.voxelSize)).band;
      });
    }
    if (out.wantsPeer(at, 6, 1))
      measure("auto", peer::kCurvature, [&] { return peer::curvatureFlow(solid, kTime); });
  }
}

/// How far off a flow may end.
struct Limits {
  double mean, largest;  ///< distance of the surface, voxels
  double volume;         ///< relative
};

/// One flow by steps of 1000 explicit ones, and whether it took them.
void expectLongSteps(Recorder& out, const std::string& variant, const NarrowBand& solid,
                     double time, const CurvatureFlowOptions& options, const Truth& truth,
                     const Limits& limits) {
  const std::string expected = fmt::format(
      "steps of 1000 explicit ones; surface L1 within {} voxel, L∞ within {}, volume within {}",
      limits.mean, limits.largest, limits.volume);
  out.expect(variant, expected, [&] {
    const levelset::CurvatureFlowResult flowed = levelset::curvatureFlow(solid, time, options);
    Figures found;
    addErrors(flowed.band, truth, Mesher::Ours, found, kQuickRayCount);
    addInvariants(flowed.band, truth, found);
    const double longest = flowed.longestStep / flowed.shortestStep;
    const bool isNear = found["surface_l1_vx"] <= limits.mean &&
                        found["surface_linf_vx"] <= limits.largest &&
                        std::abs(found["volume_error"]) <= limits.volume;
    const bool isWhole = found["missed_hits"] <= kMostMissed && found["missing_band"] == 0 &&
                         found["checks_failed"] == 0;
    return std::pair{
        longest > 999.9 && isNear && isWhole,
        fmt::format("{} steps, the longest of {:.1f} explicit ones; surface L1 {:.3g} voxel, L∞ "
                    "{:.3g}, volume {:+.2e}, {}",
                    flowed.steps, longest, found["surface_l1_vx"], found["surface_linf_vx"],
                    found["volume_error"], isWhole ? "whole" : "not whole")};
  });
}

/// r = a (1 + ε P2(cos of the angle to z)) of a ball's volume times 1 + 3 `kept`² / 5, which is
/// that of a = 1 and ε = `kept`.
Truth oval(const V3d& centre, double elongation, double kept) {
  const auto share = [](double e) { return 1 + 0.6 * e * e; };
  const double mean = std::cbrt(share(kept) / share(elongation));
  Truth truth = ball(centre, 1);
  truth.volume = *truth.volume * share(kept);
  truth.area.reset();
  truth.reach = 1 + kept;
  truth.distance = [=](const V3d& p) {
    const V3d q = p - centre;
    const double r = q.length(), z = r > 0 ? q.z / r : 0;
    return r - mean * (1 + elongation * (1.5 * z * z - 0.5));
  };
  return truth;
}

void stiff(Recorder& out) {
  const V3d centre(0.01, 0.02, 0.03);
  constexpr double kElongation = 0.04;
  for (const Integrator& i : kUnlimited) {
    constexpr double kVoxelSize = 1.0 / 40, kTime = 370 * kVoxelSize * kVoxelSize;
    CurvatureFlowOptions options = longSteps(i.scheme, kVoxelSize);
    options.preservesVolume = true;
    // To first order in ε the wave dies as exp(−4 t); what is of second order is 0.06 voxel, and
    // steps of implicit Euler, 800 and 1000 explicit ones long, would err by 0.1.
    expectLongSteps(out, std::string("an oval becomes rounder, ") + i.name,
                    exactBand(oval(centre, kElongation, kElongation), kVoxelSize), kTime, options,
                    oval(centre, kElongation * std::exp(-4 * kTime), kElongation),
                    {.mean = 0.1, .largest = 0.15, .volume = 2e-4});
  }
  if (out.isQuick()) return;
  for (const Integrator& i : kUnlimited) {
    constexpr double kVoxelSize = 1.0 / 256, kTime = 540 * kVoxelSize * kVoxelSize;
    const NarrowBand solid = exactBand(ball(centre, 1), kVoxelSize);
    // Steps of Euler that long would err by 0.011 voxel, and each of five times that distances are
    // made again by a thousandth.
    expectLongSteps(out, std::string("a ball of 256 voxels shrinks, ") + i.name, solid, kTime,
                    longSteps(i.scheme, kVoxelSize), ball(centre, std::sqrt(1 - 4 * kTime)),
                    {.mean = 0.02, .largest = 0.1, .volume = 3e-4});
  }
}

/// A long capsule: its middle is a cylinder, R² = R0² − 2 t, until the ends' effect arrives.
void shrinkCylinder(Recorder& out) {
  constexpr double kTime = (1 - 0.49) / 2 * 0.16;
  const V3d axis = V3d(1, 2, 3).normalized();
  for (const Sample& at : out.samples()) {
    const NarrowBand solid =
        exactBand(capsule(at.shift - 1.5 * axis, at.shift + 1.5 * axis, 0.4), at.voxelSize);
    Truth truth = capsule(at.shift - 1.5 * axis, at.shift + 1.5 * axis, 0.28);
    truth.volume.reset();
    truth.area.reset();
    truth.compared = [=](const V3d& p) { return std::abs((p - at.shift).dot(axis)) < 0.6; };
    const auto made = out.measure({"cylinder", at, truth}, kOurs,
                                  [&] { return levelset::curvatureFlow(solid, kTime).band; });
    if (made) out.set("value_error", out.newest("band_in_linf") / 0.28);
  }
}

NarrowBand dumbBell(double voxelSize) {
  const NarrowBand balls = levelset::unite(exactBand(ball(V3d(-1, 0, 0), 0.5), voxelSize),
                                           exactBand(ball(V3d(1, 0, 0), 0.5), voxelSize));
  return levelset::unite(balls, exactBand(capsule(V3d(-1, 0, 0), V3d(1, 0, 0), 0.15), voxelSize));
}

std::pair<bool, std::string> topology(const NarrowBand& band, std::size_t components, long euler) {
  const levelset::Measurement m = levelset::measure(band);
  const bool sound = levelset::check(band).passed();
  return {m.components == components && m.euler == euler && sound,
          fmt::format("{} solids, Euler characteristic {}, {}", m.components, m.euler,
                      sound ? "sound" : "not sound")};
}

void pinch(Recorder& out) {
  for (const double h : {1.0 / 16, 1.0 / 24, 1.0 / 32}) {
    if (out.isQuick() && h < 1.0 / 16) continue;
    const std::string where = fmt::format(", {} voxels per unit", std::lround(1 / h));
    // The bar of radius 0.15 is gone by t = 0.15² / 2, the balls by 0.5² / 4.
    out.expect("dumb-bell at t = 0.004" + where, "one solid",
               [=] { return topology(levelset::curvatureFlow(dumbBell(h), 0.004).band, 1, 2); });
    out.expect("dumb-bell at t = 0.02" + where, "two solids, as spheres",
               [=] { return topology(levelset::curvatureFlow(dumbBell(h), 0.02).band, 2, 4); });
    // κ of the tube is 1 / 0.2 all round; the hole of the fat one closes before the tube goes.
    out.expect("thin torus at t = 0.01" + where, "still a torus", [=] {
      return topology(
          levelset::curvatureFlow(exactBand(torus(V3d(0), V3d(1, 2, 3), 0.8, 0.2), h), 0.01).band,
          1, 0);
    });
    out.expect("fat torus at t = 0.06" + where, "its hole closes", [=] {
      return topology(
          levelset::curvatureFlow(exactBand(torus(V3d(0), V3d(1, 2, 3), 0.6, 0.5), h), 0.06).band,
          1, 2);
    });
  }
}

void thinThings(Recorder& out) {
  constexpr double kVoxelSize = 1.0 / 16;
  const V3d centre(0.01, 0.02, 0.03);
  const auto shrinks = [&](const char* name, const Truth& truth) {
    out.expect(name, "sound and smaller, or refused as vanished", [=] {
      try {
        const NarrowBand solid = exactBand(truth, kVoxelSize);
        const NarrowBand made = levelset::curvatureFlow(solid, 0.01).band;
        const double before = levelset::measure(solid).volume,
                     after = levelset::measure(made).volume;
        const bool sound = levelset::check(made).passed();
        return std::pair{sound && after < before,
                         fmt::format("{}, volume {:.4g} to {:.4g}", sound ? "sound" : "not sound",
                                     before, after)};
      } catch (const levelset::InvalidInput& error) {
        return std::pair{true, std::string(error.what())};
      }
    });
  };
  shrinks("plate of one voxel", box(centre, V3d(1, 1, kVoxelSize)));
  shrinks("needle of one voxel", capsule(centre - V3d(0.5), centre + V3d(0.5), kVoxelSize / 2));
  out.expectRefusal("sphere past its end", levelset::ExitCode::Input, [=] {
    (void)levelset::curvatureFlow(exactBand(ball(centre, 0.5), kVoxelSize), 1);
  });
}

std::vector<Bound> sphereBounds() {
  std::vector<Bound> bounds = {{"auto", "value_error", 0.01}};
  for (const Integrator& i : kIntegrators) {
    // 0.02 voxel of the steps, or what explicit steps err, 0.22 voxel over the radius in voxels;
    // and a thousandth for each time that distances are made again.
    bounds.push_back({i.name, "surface_l1_vx", 0.04});
    bounds.push_back({i.name, "checks_failed", 0});
    for (const int resolution : {32, 64})
      bounds.push_back({i.name, "value_error", 1e-3, resolution});
  }
  // Steps of Euler that cross a voxel and a half would err by 0.75 voxel; these are of second
  // order.
  for (const Integrator& i : kUnlimited) {
    bounds.push_back({asLongAsTheBand(i), "surface_linf_vx", 0.2});
    bounds.push_back({asLongAsTheBand(i), "checks_failed", 0});
  }
  return bounds;
}

}  // namespace

void addCurvatureCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "curvature-sphere",
       .group = "curvature flow",
       .title = "a sphere shrinks to half its radius",
       .definition =
           "φ_t = κ|∇φ|, κ = k1 + k2: a sphere of radius 1 obeys R² = 1 − 4t and is taken "
           "to R = 1/2 by each integrator, and by steps of 1000 explicit ones, cut where the "
           "surface leaves the band, a voxel and a half. value: mean distance of the surface from "
           "the exact one, over the radius.",
       .citation = "Meyer14, Smereka03",
       .quick = {6, 8, 12},
       .full = {16, 32, 64},
       .bounds = sphereBounds(),
       .run = shrinkSphere});
  all.push_back(
      {.name = "curvature-cylinder",
       .group = "curvature flow of a cylinder",
       .title = "the middle of a long capsule shrinks as a cylinder",
       .definition =
           "Capsule of radius 0.4 and length 3 about (1, 2, 3): in its middle R² = 0.16 − "
           "2t, to R = 0.28. value: largest error of the band inside, over the radius.",
       .citation = "Meyer14, Smereka03",
       .quick = {8, 10, 16},
       .full = {16, 32, 64},
       .bounds = {{"cylinder", "value_error", 0.02}, {"cylinder", "value_error", 5e-3, 32}},
       .run = shrinkCylinder});
  const auto add = [&](const char* name, const char* title, const char* definition,
                       void (*run)(Recorder&)) {
    all.push_back(statedCase(name, title, definition, "stated outcomes; Smereka03", run));
  };
  add("curvature-topology", "a dumb-bell pinches, tori shrink and close",
      "Balls of radius 0.5 joined by a bar of radius 0.15; tori 0.8 / 0.2 and 0.6 / 0.5.", pinch);
  add("curvature-stiff", "steps of 1000 explicit ones",
      "A solid r = 1 + 0.04 P2(cos θ), 40 voxels per unit, keeps its volume until t = 0.23 (370 "
      "voxels²), when the wave has fallen to exp(−4 t); a ball of 256 voxels shrinks for 540 "
      "voxels² (full budget).",
      stiff);
  add("curvature-thin", "a plate and a needle of one voxel, a sphere past its end",
      "Solids that curvature flow eats at once.", thinThings);
}

}  // namespace regress
