#include <fmt/core.h>

#include <algorithm>
#include <vector>

#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/inspect/compare.h"
#include "levelset/solids/morph.h"

namespace regress {

using Imath::V3d;
using levelset::NarrowBand;

namespace {

/// The largest part of a difference that the next step leaves: below 1 if they fall strictly.
double mostLeft(const std::vector<double>& differences) {
  double most = 0;
  for (std::size_t i = 1; i < differences.size(); ++i)
    most = std::max(most, differences[i - 1] > 0 ? differences[i] / differences[i - 1] : 1);
  return most;
}

/// Of twenty even steps the first leaves 0.95 of the difference, and each after it less.
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
      // Steps that were not kept did not fall.
      const bool isWhole = static_cast<int>(kept.size()) == steps;
      out.set("value_error", isWhole ? mostLeft(differences) : 1);
    }
  }
  const double h = 1.0 / 12;
  const NarrowBand here = exactBand(ball(V3d(0), 0.5), h),
                   there = exactBand(ball(V3d(2, 0, 0), 0.5), h);
  out.expectRefusal("to a disjoint target in five steps", levelset::ExitCode::Input,
                    [&] { (void)levelset::morph(here, there, {.steps = 5}); });
  out.expect("to a disjoint target in one step", "the target, within 0.1 voxel", [&] {
    const NarrowBand made = levelset::morph(here, there);
    const double off = levelset::compare(made, there).hausdorff() / h;
    return std::pair{off <= 0.1, fmt::format("Hausdorff distance {:.3g} voxels", off)};
  });
}

std::vector<Bound> morphBounds() {
  std::vector<Bound> bounds;
  for (const char* variant :
       {"sphere to shifted sphere", "sphere to cube", "cube to torus", "torus to sphere"}) {
    bounds.push_back({variant, "value_error", kMostLeft});
    bounds.push_back({variant, "checks_failed", 0});
    bounds.push_back({variant, "surface_linf_vx", 0.5});
  }
  allowAtEdges(bounds, "sphere to cube", 0.6, {5, 6, 8, 16});
  return bounds;
}

}  // namespace

void addMorphCases(std::vector<Case>& all) {
  all.push_back({.name = "morph",
                 .group = "morphing",
                 .title = "sphere, cube and torus into each other",
                 .definition =
                     "Sphere of radius 0.8, cube of edge 1.3 and torus 0.7 / 0.3 about one point, "
                     "and a sphere shifted by (0.5, 0.3, 0.2), in 20 kept steps, 5 in the quick "
                     "budget. value: the volume by which a step differs from the target, over "
                     "that of the step before it, where it falls least. A disjoint target is "
                     "refused, but in one step.",
                 .citation = "closed forms; Museth02",
                 .quick = {5, 6, 8},
                 .full = {16, 32, 64},
                 .bounds = morphBounds(),
                 .run = morphShapes});
}

}  // namespace regress
