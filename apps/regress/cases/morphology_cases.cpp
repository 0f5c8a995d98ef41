#include "levelset/offset/morphology.h"

#include <fmt/core.h>

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/csg/csg.h"
#include "levelset/inspect/check.h"
#include "levelset/inspect/measure.h"

namespace regress {

using Imath::V3d;
using levelset::NarrowBand;

namespace {

void openAndClose(Recorder& out) {
  constexpr double kRadius = 0.2;
  const V3d size(1.2, 0.9, 0.7);
  for (const Sample& at : out.samples()) {
    const double h = at.voxelSize;
    const Truth cuboid = box(at.shift, size);
    const Truth rounded = box(at.shift, size - V3d(2 * kRadius), kRadius);
    const NarrowBand solid = exactBand(cuboid, h);
    out.measure({"opening of a box", at, rounded}, kOurs,
                [&] { return levelset::opening(solid, kRadius); });
    out.measure({"closing of a box", at, cuboid}, kOurs,
                [&] { return levelset::closing(solid, kRadius); });
    if (out.wantsPeer(at, 12, 1)) {
      out.measure({"opening of a box", at, rounded}, peer::kFilter,
                  [&] { return peer::offset(peer::offset(solid, -kRadius), kRadius); });
      out.measure({"closing of a box", at, cuboid}, peer::kFilter,
                  [&] { return peer::offset(peer::offset(solid, kRadius), -kRadius); });
    }
    // Opening removes a bar that is thinner than the ball of the opening. The balls at the ends of
    // the bar stay unchanged.
    const Truth one = ball(at.shift, 0.5), other = ball(at.shift + V3d(1.5, 0, 0), 0.5);
    const NarrowBand joined =
        levelset::unite(exactBand(apart(one, other), h),
                        exactBand(capsule(at.shift, at.shift + V3d(1.5, 0, 0), 0.12), h));
    out.measure({"opening of a dumb-bell", at, apart(one, other)}, kOurs,
                [&] { return levelset::opening(joined, kRadius); });
  }
  for (const double h : {1.0 / 16, 1.0 / 32}) {
    if (out.isQuick() && h < 1.0 / 16) continue;
    const std::string where = fmt::format(", {} voxels per unit", std::lround(1 / h));
    const NarrowBand pair =
        exactBand(apart(box(V3d(0), V3d(0.6)), box(V3d(0.9, 0, 0), V3d(0.6))), h);
    out.expect("closing fills a slot of 0.3" + where, "one sound solid, no cavity", [&] {
      const NarrowBand made = levelset::closing(pair, kRadius);
      const levelset::Measurement m = levelset::measure(made);
      const bool sound = levelset::check(made).passed();
      return std::pair{m.components == 1 && m.cavities == 0 && sound,
                       fmt::format("{} solids, {} cavities, {}", m.components, m.cavities,
                                   sound ? "sound" : "not sound")};
    });
    out.expectRefusal("opening by a ball that does not fit" + where, levelset::ExitCode::Input,
                      [&] { (void)levelset::opening(pair, 0.4); });
  }
}

void hollow(Recorder& out) {
  constexpr double kThickness = 0.25;
  for (const Sample& at : out.samples()) {
    const NarrowBand solid = exactBand(ball(at.shift, 1), at.voxelSize);
    const Truth outer = ball(at.shift, 1), inner = ball(at.shift, 1 - kThickness);
    Truth wall = outer;
    wall.distance = [=](const V3d& p) { return std::max(outer.distance(p), -inner.distance(p)); };
    wall.volume = *outer.volume - *inner.volume;
    wall.area = *outer.area + *inner.area;
    out.measure({"wall of a sphere", at, wall}, kOurs,
                [&] { return levelset::shell(solid, kThickness); });
  }
}

Bounds openingClosingBounds() {
  return Bounds()
      .measured("opening of a box", "band_in_linf_vx",
                {{12, 0.00481}, {32, 0.00483}, {128, 0.00143}})
      .rounding("opening of a box", "band_in_linf_vx", 2.5, 64)
      .rounding("opening of a box", "band_in_linf_vx", 2.5, 24)
      .rounding("opening of a box", "band_in_linf_vx", 2.5, 16)
      .measured("opening of a box", "band_out_linf_vx",
                {{12, 0.00483}, {32, 0.00936}, {128, 0.00138}})
      .rounding("opening of a box", "band_out_linf_vx", 2, 16)
      .rounding("opening of a box", "band_out_linf_vx", 2, 24)
      .rounding("opening of a box", "band_out_linf_vx", 2.5, 64)
      .measured("opening of a box", "surface_l1_vx",
                {{12, 0.0072},
                 {16, 0.00297},
                 {24, 0.00134},
                 {32, 0.00105},
                 {64, 0.000223},
                 {128, 0.000142}})
      .measured("closing of a box", "band_in_linf_vx",
                {{12, 0.00012}, {32, 0.00012}, {128, 0.0002}})
      .rounding("closing of a box", "band_in_linf_vx", 1.5, 16)
      .rounding("closing of a box", "band_in_linf_vx", 1.5, 24)
      .rounding("closing of a box", "band_in_linf_vx", 1.5, 64)
      .measured("closing of a box", "band_out_linf_vx",
                {{12, 0.000316},
                 {16, 0.000275},
                 {24, 9.91e-05},
                 {32, 0.00034},
                 {64, 0.000228},
                 {128, 0.000195}})
      .measured("opening of a box", "missed_hits",
                {{12, 0.00262}, {16, 0.00218}, {32, 0.000205}, {128, 0.000162}})
      .measured(
          "closing of a box", "surface_l1_vx",
          {{12, 0.0222}, {16, 0.0149}, {24, 0.0104}, {32, 0.00877}, {64, 0.00454}, {128, 0.00218}})
      .measured(
          "opening of a dumb-bell", "surface_l1_vx",
          {{12, 0.00865}, {16, 0.00284}, {24, 0.00469}, {32, 0.0116}, {64, 0.0144}, {128, 0.0279}})
      .measured(
          "closing of a box", "missed_hits",
          {{12, 0.0602}, {16, 0.039}, {24, 0.0234}, {32, 0.0176}, {64, 0.0084}, {128, 0.00565}})
      .measured("opening of a dumb-bell", "missed_hits",
                {{12, 0.00422}, {24, 0.00167}, {32, 0.00153}, {64, 0.000345}, {128, 0.000987}});
}

Bounds shellBounds() {
  return Bounds()
      .measured("wall of a sphere", "surface_l1_vx",
                {{12, 0.00177}, {16, 0.000185}, {24, 3.06e-5}, {32, 1.7e-5}, {64, 4.29e-6}})
      .ceiling(0.002)
      .measured("wall of a sphere", "band_in_linf_vx",
                {{12, 0.00076}, {16, 0.000429}, {24, 9.49e-05}, {32, 0.0001}, {64, 2.79e-5}})
      .measured("wall of a sphere", "band_out_linf_vx",
                {{12, 0.000751}, {16, 0.000203}, {24, 0.000162}, {32, 0.000103}, {64, 2.77e-5}})
      .measured("wall of a sphere", "missed_hits", {{12, 0.000456}, {32, 8.09e-5}});
}

}  // namespace

void addMorphologyCases(std::vector<Case>& all) {
  all.push_back({.name = "opening-closing",
                 .group = "opening and closing",
                 .title = "opening and closing by a ball",
                 .definition =
                     "With a ball of radius 0.2: opening a box 1.2 × 0.9 × 0.7 rounds its edges, "
                     "closing leaves it unchanged. Opening two balls of radius 0.5 with a bar of "
                     "radius 0.12 leaves the balls and a small part of the bar at each ball. The "
                     "closed form has the balls alone, so only the mean is bounded.",
                 .citation = "Serra82",
                 .quick = {12, 16, 24},
                 .full = {32, 64, 128},
                 .bounds = openingClosingBounds(),
                 .run = openAndClose});
  all.push_back(
      {.name = "shell",
       .group = "shell",
       .title = "hollowing a sphere to a wall",
       .definition =
           "A sphere of radius 1 is hollowed to a wall of thickness 0.25 inside its surface.",
       .citation = "closed form",
       .quick = {12, 16, 24},
       .full = {16, 32, 64},
       .bounds = shellBounds(),
       .run = hollow});
}

}  // namespace regress
