#include <fmt/core.h>

#include <cmath>

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/csg/csg.h"
#include "levelset/curvature_flow/curvature_flow.h"
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
/// Integrators that are stable at any step length. The explicit integrator would shorten its steps.
constexpr Integrator kUnlimited[] = {kIntegrators[2], kIntegrators[3]};

std::string asLongAsTheBand(const Integrator& i) {
  return std::string(i.name) + ", steps as long as the band";
}

/// Longest stable time step of explicit Euler for curvature flow, in units of the squared voxel
/// size.
constexpr double kExplicitStep = 0.16;

/// Returns options for steps that are 1000 times as long as the longest stable explicit step, with
/// a tolerance that accepts any error.
CurvatureFlowOptions longSteps(FlowScheme scheme, double voxelSize) {
  return {.scheme = scheme,
          .tolerance = 1000 * voxelSize,
          .step = 1000 * kExplicitStep * voxelSize * voxelSize};
}

/// Measures the flow of a sphere. value_error is the mean distance between surface and exact
/// surface, over the exact radius.
void shrinkSphere(Recorder& out) {
  constexpr double kTime =
      (1 - 0.25) / 4;  // time in which the radius R falls from 1 to 1/2: R² = 1 − 4 t
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
    // One step of the requested length would remove the ball. Each step therefore ends when the
    // surface would leave the band.
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

/// Measured errors at the end of a flow, or limits on them.
struct FlowErrors {
  double mean, largest;   ///< distance between the surface and the exact surface, voxels
  double volume;          ///< relative error of the volume
  double missedHits = 0;  ///< missing and surplus zeros along rays, over the exact zeros
  bool isLimit = false;   ///< true: limits of a run that is too long to measure
};

/// Expects that a flow takes steps 1000 times as long as explicit ones, and that it ends with the
/// measured errors.
void expectLongSteps(Recorder& out, const std::string& variant, const NarrowBand& solid,
                     double time, const CurvatureFlowOptions& options, const Truth& truth,
                     const FlowErrors& measured) {
  const std::string expected = fmt::format(
      "steps 1000 times as long as explicit ones; {}: surface L1 {} voxels, L∞ {}, volume {}, "
      "missed hits {}",
      measured.isLimit ? "at most" : "as measured", measured.mean, measured.largest,
      measured.volume, measured.missedHits);
  out.expect(variant, expected, [&] {
    const levelset::CurvatureFlowResult flowed = levelset::curvatureFlow(solid, time, options);
    Figures found;
    addErrors(flowed.band, truth, Mesher::Ours, found, kQuickRayCount);
    addInvariants(flowed.band, truth, found);
    const double longest = flowed.longestStep / flowed.shortestStep;
    const auto isMet = [&](const char* column, double stated) {
      return measured.isLimit ? std::abs(found[column]) <= stated
                              : isAsMeasured(found[column], stated);
    };
    const bool isNear =
        isMet("surface_l1_vx", measured.mean) && isMet("surface_linf_vx", measured.largest) &&
        isMet("volume_error", measured.volume) && isMet("missed_hits", measured.missedHits);
    const bool isWhole = found["missing_band"] == 0 && found["checks_failed"] == 0;
    return std::pair{
        longest > 999.9 && isNear && isWhole,
        fmt::format("{} steps, the longest {:.1f} times as long as an explicit one; surface L1 "
                    "{:.3g} voxels, L∞ {:.3g}, volume {:+.2e}, missed hits {:.3g}, {}",
                    flowed.steps, longest, found["surface_l1_vx"], found["surface_linf_vx"],
                    found["volume_error"], found["missed_hits"],
                    isWhole ? "no gaps, all checks passed" : "gaps or failed checks")};
  });
}

/// Solid r = a (1 + ε P2(cos θ)), θ the angle to z, ε the elongation. The radius a is such that the
/// volume equals that of the solid with a = 1 and ε = `kept`: a ball's volume times 1 + 3 `kept`² /
/// 5.
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
  const auto expectRounder = [&](const Integrator& i, const FlowErrors& measured) {
    constexpr double kVoxelSize = 1.0 / 40, kTime = 370 * kVoxelSize * kVoxelSize;
    CurvatureFlowOptions options = longSteps(i.scheme, kVoxelSize);
    options.preservesVolume = true;
    // To first order, the elongation ε decays as exp(−4 t); the neglected second-order term is 0.06
    // voxel. First-order implicit Euler, with steps 800 and 1000 times as long as an explicit one,
    // would have an error of 0.1 voxel.
    expectLongSteps(out, std::string("an oval becomes rounder, ") + i.name,
                    exactBand(oval(centre, kElongation, kElongation), kVoxelSize), kTime, options,
                    oval(centre, kElongation * std::exp(-4 * kTime), kElongation), measured);
  };
  const auto& [stabilized, implicit] = kUnlimited;
  expectRounder(stabilized,
                {.mean = 0.011, .largest = 0.0334, .volume = 1.54e-5, .missedHits = 5.2e-4});
  expectRounder(implicit,
                {.mean = 0.0348, .largest = 0.0942, .volume = 3.16e-5, .missedHits = 1.04e-3});
  if (out.isQuick()) return;
  const auto expectSmaller = [&](const Integrator& i, const FlowErrors& measured) {
    constexpr double kVoxelSize = 1.0 / 256, kTime = 540 * kVoxelSize * kVoxelSize;
    const NarrowBand solid = exactBand(ball(centre, 1), kVoxelSize);
    // Euler steps of the length of longSteps() have an error of 0.011 voxel. Each of the five
    // redistancing passes adds 0.001 voxel.
    expectLongSteps(out, std::string("a ball of 256 voxels shrinks, ") + i.name, solid, kTime,
                    longSteps(i.scheme, kVoxelSize), ball(centre, std::sqrt(1 - 4 * kTime)),
                    measured);
  };
  constexpr FlowErrors kLimits{
      .mean = 0.02, .largest = 0.1, .volume = 3e-4, .missedHits = 0.025, .isLimit = true};
  expectSmaller(stabilized, kLimits);
  expectSmaller(implicit, kLimits);
}

/// Shrinks a long capsule. Its middle shrinks as a cylinder, R² = R0² − 2 t, until the effect of
/// the ends arrives there.
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
    // The bar of radius 0.15 vanishes by t = 0.15² / 2, the balls by t = 0.5² / 4.
    out.expect("dumb-bell at t = 0.004" + where, "one solid",
               [=] { return topology(levelset::curvatureFlow(dumbBell(h), 0.004).band, 1, 2); });
    out.expect("dumb-bell at t = 0.02" + where, "two solids with the topology of spheres",
               [=] { return topology(levelset::curvatureFlow(dumbBell(h), 0.02).band, 2, 4); });
    // The curvature of the thin tube is 1 / 0.2. The hole of the fat torus closes before its tube
    // vanishes.
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
  out.expectRefusal("sphere beyond the time at which it vanishes", levelset::ExitCode::Input, [=] {
    (void)levelset::curvatureFlow(exactBand(ball(centre, 0.5), kVoxelSize), 1);
  });
}

/// The time steps have an error of up to 0.02 voxel, explicit steps one of 0.22 voxel divided by
/// the radius in voxels. Each redistancing pass adds 0.001 voxel. Steps as long as the band must be
/// of second order: Euler steps in which the surface moves 1.5 voxels have an error of 0.75 voxel.
Bounds curvatureSphereBounds() {
  return Bounds()
      .measured(
          "auto", "value_error",
          {{6, 0.00534}, {8, 0.00194}, {12, 0.00184}, {16, 0.00133}, {32, 0.000522}, {64, 7.17e-5}})
      .measured("auto", "surface_l1_vx",
                {{6, 0.016}, {8, 0.00774}, {12, 0.011}, {16, 0.0106}, {32, 0.00835}, {64, 0.00229}})
      .zero("auto", "checks_failed")
      .measured("explicit", "surface_l1_vx",
                {{6, 0.0287}, {8, 0.0268}, {12, 0.0167}, {16, 0.0124}, {32, 0.00834}, {64, 0.0101}})
      .ceiling(0.04)
      .zero("explicit", "checks_failed")
      .measured("stabilized", "surface_l1_vx",
                {{6, 0.016}, {8, 0.00774}, {12, 0.011}, {16, 0.0107}, {32, 0.00835}, {64, 0.00229}})
      .zero("stabilized", "checks_failed")
      .measured(
          "implicit", "surface_l1_vx",
          {{6, 0.00497}, {8, 0.00468}, {12, 0.00118}, {16, 0.00167}, {32, 0.00393}, {64, 0.0275}})
      .zero("implicit", "checks_failed")
      .measured("stabilized, steps as long as the band", "surface_linf_vx",
                {{6, 0.025}, {8, 0.0138}, {12, 0.018}, {16, 0.0155}, {32, 0.00959}, {64, 0.00284}})
      .zero("stabilized, steps as long as the band", "checks_failed")
      .measured("implicit, steps as long as the band", "surface_linf_vx",
                {{6, 0.0124}, {8, 0.0149}, {12, 0.0473}, {16, 0.0768}, {32, 0.163}, {64, 0.105}})
      .zero("implicit, steps as long as the band", "checks_failed")
      .measured(
          "auto", "missed_hits",
          {{6, 0.00881}, {8, 0.00638}, {12, 0.00334}, {16, 0.0018}, {32, 0.0011}, {64, 0.000253}})
      .measured(
          "explicit", "missed_hits",
          {{6, 0.0198}, {8, 0.0175}, {12, 0.00334}, {16, 0.00247}, {32, 0.00094}, {64, 0.000759}})
      .ceiling(0.025)
      .measured(
          "stabilized", "missed_hits",
          {{6, 0.00881}, {8, 0.00638}, {12, 0.00334}, {16, 0.00202}, {32, 0.0011}, {64, 0.000253}})
      .measured("implicit", "missed_hits", {{8, 0.00638}, {16, 0}, {32, 0.000157}, {64, 0.00152}})
      .measured(
          "stabilized, steps as long as the band", "missed_hits",
          {{6, 0.00881}, {8, 0.00638}, {12, 0.0078}, {16, 0.00202}, {32, 0.0011}, {64, 0.000253}})
      .measured("implicit, steps as long as the band", "missed_hits",
                {{8, 0.00957}, {12, 0.0145}, {16, 0.02}, {32, 0.0182}, {64, 0.00721}})
      .measured("explicit", "value_error",
                {{6, 0.00957}, {8, 0.0067}, {12, 0.00278}, {32, 0.000521}, {64, 0.000316}})
      .measured("stabilized", "value_error",
                {{6, 0.00534}, {8, 0.00194}, {12, 0.00184}, {32, 0.000522}, {64, 7.17e-5}})
      .measured("implicit", "value_error",
                {{6, 0.00166}, {8, 0.00117}, {12, 0.000196}, {32, 0.000246}, {64, 0.00086}});
}

Bounds curvatureCylinderBounds() {
  return Bounds().measured(
      "cylinder", "value_error",
      {{8, 0.0121}, {10, 0.00229}, {16, 0.000842}, {32, 0.000138}, {64, 0.0001}});
}

}  // namespace

void addCurvatureCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "curvature-sphere",
       .group = "curvature flow",
       .title = "a sphere shrinks to half its radius",
       .definition =
           "φ_t = κ|∇φ|, κ = k1 + k2: a sphere of radius 1 obeys R² = 1 − 4t. Each integrator "
           "shrinks it to R = 1/2. Further variants request steps 1000 times as long as explicit "
           "ones; these end when the surface would leave the band, after 1.5 voxels. value: mean "
           "distance between surface and exact surface, over the radius.",
       .citation = "Meyer14, Smereka03",
       .quick = {6, 8, 12},
       .full = {16, 32, 64},
       .bounds = curvatureSphereBounds(),
       .run = shrinkSphere});
  all.push_back(
      {.name = "curvature-cylinder",
       .group = "curvature flow of a cylinder",
       .title = "the middle of a long capsule shrinks as a cylinder",
       .definition =
           "A capsule of radius 0.4 and length 3 along (1, 2, 3) shrinks: in its middle R² = 0.16 "
           "− 2t, until R = 0.28. value: largest error of the band inside, over the radius.",
       .citation = "Meyer14, Smereka03",
       .quick = {8, 10, 16},
       .full = {16, 32, 64},
       .bounds = curvatureCylinderBounds(),
       .run = shrinkCylinder});
  const auto add = [&](const char* name, const char* title, const char* definition,
                       void (*run)(Recorder&)) {
    all.push_back(statedCase(name, title, definition, "stated outcomes; Smereka03", run));
  };
  add("curvature-topology", "a dumb-bell pinches, tori shrink and close",
      "Two balls of radius 0.5 joined by a bar of radius 0.15, and tori with ring / tube radii 0.8 "
      "/ 0.2 and 0.6 / 0.5. The topology after the flow is stated.",
      pinch);
  add("curvature-stiff", "time steps 1000 times as long as explicit ones",
      "A solid r = 1 + ε P2(cos θ) with ε = 0.04, 40 voxels per unit, flows until t = 0.23 (370 "
      "voxels²) and keeps its volume. By then ε has decayed by the factor exp(−4 t). In the full "
      "budget, a ball of radius 256 voxels also shrinks for 540 voxels².",
      stiff);
  add("curvature-thin", "a plate and a needle one voxel thick, and a sphere that vanishes",
      "Solids so thin that curvature flow shrinks or removes them at once.", thinThings);
}

}  // namespace regress
