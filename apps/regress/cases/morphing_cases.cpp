#include <fmt/core.h>

#include <algorithm>
#include <vector>

#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/inspect/compare.h"
#include "levelset/morph/morph.h"

namespace regress {

using Imath::V3d;
using levelset::MorphMethod;
using levelset::NarrowBand;

namespace {

/// Returns the largest ratio of an element to its predecessor. `differences` are the volumes of the
/// symmetric differences of target and morph, step by step. Below 1, they fall strictly; after a
/// difference of 0 the ratio counts as 1.
double mostLeft(const std::vector<double>& differences) {
  double most = 0;
  for (std::size_t i = 1; i < differences.size(); ++i)
    most = std::max(most, differences[i - 1] > 0 ? differences[i] / differences[i - 1] : 1);
  return most;
}

/// Largest accepted result of mostLeft(). The first of twenty even steps leaves 0.95 of the
/// difference, and each later step leaves a smaller ratio.
constexpr double kMostLeft = 0.99;

void morphShapes(Recorder& out) {
  struct Pair {
    const char* name;
    Truth from, to;
  };
  const int steps = out.isQuick() ? 5 : 20;
  for (const Sample& at : out.samples()) {
    const V3d c = at.shift;
    const Truth sphere = ball(c, 0.8), cube = box(c, V3d(1.3)),
                ring = torus(c, V3d(1, 2, 3), 0.7, 0.3);
    const Pair pairs[] = {{"sphere to shifted sphere", sphere, ball(c + V3d(0.5, 0.3, 0.2), 0.8)},
                          {"sphere to cube", sphere, cube},
                          {"cube to torus", cube, ring},
                          {"torus to sphere", ring, sphere}};
    for (const Pair& pair : pairs) {
      const NarrowBand from = exactBand(pair.from, at.voxelSize),
                       to = exactBand(pair.to, at.voxelSize);
      std::vector<NarrowBand> kept;
      const auto made = out.measure({pair.name, at, pair.to}, kOurs, [&] {
        return levelset::morph(from, to, {.steps = steps, .keep = [&](const NarrowBand& step, int) {
                                            kept.push_back(step);
                                          }});
      });
      if (!made) continue;
      std::vector<double> differences{levelset::compare(from, to).symmetricDifference};
      for (const NarrowBand& step : kept)
        differences.push_back(levelset::compare(step, to).symmetricDifference);
      // If a step is missing, the value is 1, which misses the bound.
      const bool isWhole = static_cast<int>(kept.size()) == steps;
      out.set("value_error", isWhole ? mostLeft(differences) : 1);
    }
  }
  const double h = 1.0 / 12;
  const NarrowBand here = exactBand(ball(V3d(0), 0.5), h),
                   there = exactBand(ball(V3d(2, 0, 0), 0.5), h);
  out.expectRefusal("to a disjoint target in five steps", levelset::ExitCode::Input,
                    [&] { (void)levelset::morph(here, there, {.steps = 5}); });
  out.expect("to a disjoint target in one step", "the target, to rounding", [&] {
    const NarrowBand made = levelset::morph(here, there);
    const double off = levelset::compare(made, there).hausdorff() / h;
    return std::pair{isRounding(off, 1), fmt::format("Hausdorff distance {:.3g} voxels", off)};
  });
}

/// Morphs by both methods, on the same input.
void speedShapes(Recorder& out) {
  const int steps = out.isQuick() ? 3 : 10;
  for (const Sample& at : out.samples()) {
    const V3d c = at.shift;
    const Truth small = ball(c, 0.6), middle = ball(c, 0.8), big = ball(c, 1),
                cube = box(c, V3d(1.3)), ring = torus(c, V3d(1, 2, 3), 0.7, 0.3);
    const auto band = [&](const Truth& truth) { return exactBand(truth, at.voxelSize); };
    // Both methods have the exact surface of concentric balls at every fraction.
    for (const MorphMethod method : {MorphMethod::Speed, MorphMethod::Distances}) {
      const std::string by = method == MorphMethod::Speed ? ", by speed" : ", by distances";
      out.measure({"half-way between balls" + by, at, middle}, kOurs, [&] {
        return levelset::morph(band(small), band(big), {.method = method, .until = 0.5});
      });
      const std::pair<const char*, std::pair<Truth, Truth>> pairs[] = {
          {"sphere to cube", {middle, cube}}, {"torus to sphere", {ring, middle}}};
      for (const auto& [name, shapes] : pairs) {
        std::vector<double> differences;
        const NarrowBand from = band(shapes.first), to = band(shapes.second);
        const auto left = [&](const NarrowBand& step) {
          return levelset::compare(step, to).symmetricDifference;
        };
        differences.push_back(left(from));
        const auto made = out.measure({name + by, at, shapes.second}, kOurs, [&] {
          return levelset::morph(
              from, to,
              {.method = method, .steps = steps, .keep = [&](const NarrowBand& step, int) {
                 differences.push_back(left(step));
               }});
        });
        if (made) out.set("value_error", mostLeft(differences));
      }
    }
  }
  const double h = 1.0 / 12;
  const NarrowBand here = exactBand(ball(V3d(0), 0.5), h),
                   there = exactBand(ball(V3d(2, 0, 0), 0.5), h);
  out.expectRefusal("to a disjoint target by speed", levelset::ExitCode::Input,
                    [&] { (void)levelset::morph(here, there, {.method = MorphMethod::Speed}); });
}

Bounds morphBounds() {
  return Bounds()
      .required("sphere to shifted sphere", "value_error", kMostLeft)
      .zero("sphere to shifted sphere", "checks_failed")
      .measured(
          "sphere to shifted sphere", "surface_linf_vx",
          {{5, 0.00389}, {6, 0.00255}, {8, 0.00142}, {16, 0.00035}, {32, 8.53e-5}, {64, 2.02e-5}})
      .required("sphere to cube", "value_error", kMostLeft)
      .zero("sphere to cube", "checks_failed")
      .measured("sphere to cube", "surface_linf_vx",
                {{5, 0.264}, {6, 0.247}, {8, 0.187}, {16, 0.22}, {32, 0.196}, {64, 0.194}})
      .required("cube to torus", "value_error", kMostLeft)
      .zero("cube to torus", "checks_failed")
      .measured(
          "cube to torus", "surface_linf_vx",
          {{5, 0.0317}, {6, 0.0194}, {8, 0.00964}, {16, 0.00216}, {32, 0.000513}, {64, 0.000121}})
      .required("torus to sphere", "value_error", kMostLeft)
      .zero("torus to sphere", "checks_failed")
      .measured(
          "torus to sphere", "surface_linf_vx",
          {{5, 0.00384}, {6, 0.00268}, {8, 0.00133}, {16, 0.000353}, {32, 8.45e-5}, {64, 2.06e-5}})
      .measured("sphere to cube", "missed_hits",
                {{5, 0.0746}, {6, 0.09}, {8, 0.0409}, {16, 0.0235}, {32, 0.0139}, {64, 0.00455}})
      .ceiling(0.1, 6)
      .measured("sphere to shifted sphere", "missed_hits",
                {{5, 0.00159}, {6, 0.00135}, {16, 0.000172}, {32, 0}, {64, 0}})
      .measured("cube to torus", "missed_hits",
                {{5, 0.0118}, {6, 0.0066}, {16, 0.000476}, {32, 0}, {64, 0}})
      .measured("torus to sphere", "missed_hits",
                {{5, 0.00319}, {6, 0.00135}, {16, 0.000172}, {32, 0}, {64, 0}});
}

Bounds speedBounds() {
  return Bounds()
      .required("sphere to cube, by speed", "value_error", kMostLeft)
      .required("torus to sphere, by speed", "value_error", kMostLeft)
      .measured("half-way between balls, by speed", "surface_linf_vx",
                {{5, 0.00824}, {6, 0.00494}, {8, 0.00283}})
      .measured("half-way between balls, by distances", "surface_linf_vx",
                {{5, 0.00725}, {6, 0.00469}, {8, 0.00312}})
      .measured("sphere to cube, by speed", "surface_linf_vx", {{5, 0.264}, {6, 0.247}, {8, 0.187}})
      .measured("torus to sphere, by speed", "surface_linf_vx",
                {{5, 0.0139}, {6, 0.0113}, {8, 0.00994}})
      .measured("half-way between balls, by speed", "missed_hits",
                {{5, 0.00478}, {6, 0.00135}, {8, 0.00105}})
      .measured("half-way between balls, by distances", "missed_hits",
                {{5, 0.00319}, {6, 0.00135}, {8, 0.00105}})
      .measured("sphere to cube, by speed", "missed_hits", {{5, 0.0765}, {6, 0.09}, {8, 0.0409}})
      .measured("sphere to cube, by distances", "missed_hits",
                {{5, 0.0746}, {6, 0.09}, {8, 0.0409}})
      .measured("torus to sphere, by speed", "missed_hits",
                {{5, 0.00478}, {6, 0.00135}, {8, 0.00105}})
      .measured("torus to sphere, by distances", "missed_hits", {{5, 0.00319}, {6, 0.00135}});
}

}  // namespace

void addMorphCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "morph",
       .group = "morphing",
       .title = "morphs between a sphere, a cube and a torus",
       .definition =
           "Morphs between a sphere of radius 0.8, a cube of edge 1.3 and a torus (ring radius "
           "0.7, tube radius 0.3) about one point, and to a sphere shifted by (0.5, 0.3, 0.2), in "
           "20 steps, 5 in the quick budget. The symmetric difference of a step and the target "
           "must fall from step to step. value: largest ratio of its volume to that of the "
           "previous step. A disjoint target is refused, except in one step.",
       .citation = "closed forms; Museth02",
       .quick = {5, 6, 8},
       .full = {16, 32, 64},
       .bounds = morphBounds(),
       .run = morphShapes});
  all.push_back(
      {.name = "morph-speed",
       .group = "morphing",
       .title = "both methods of the morph side by side",
       .definition =
           "Between concentric spheres of radius 0.6 and 1, half-way is a sphere of radius 0.8: "
           "with "
           "the speed φ − φ_target the radius is 1 − 0.4 exp(−t), and t = ln 2. A sphere of radius "
           "0.8 to a cube of edge 1.3, and a torus (0.7, 0.3) to the sphere, must end on the "
           "target. "
           "value: largest ratio of the volume of the symmetric difference of a step and the "
           "target "
           "to that of the previous step, in 10 steps, 3 in the quick budget. A disjoint target is "
           "refused.",
       .citation = "closed forms; Breen01",
       .quick = {5, 6, 8},
       .full = {16, 32, 64},
       .bounds = speedBounds(),
       .run = speedShapes});
}

}  // namespace regress
