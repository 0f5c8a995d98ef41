#include "levelset/distance/redistance.h"

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"

namespace regress {

using Imath::V3d;
using levelset::NarrowBand;

namespace {

void mendSlopes(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const Subject subject{"waves of 4 voxels", at, ball(at.shift, 1)};
    const NarrowBand field = perturbedBand(subject.truth, at.voxelSize, at.voxelSize);
    out.measure(subject, kOurs, [&] { return levelset::redistance(field); });
    if (out.wantsPeer(at, 24)) {
      out.measure(subject, peer::kRebuild, [&] { return peer::rebuild(field); });
      out.measure(subject, peer::kSweep, [&] { return peer::sweep(field); });
    }
    const NarrowBand smooth = perturbedBand(subject.truth, at.voxelSize, 1.0 / 16);
    out.measure({"waves of 4/16", at, subject.truth}, kOurs,
                [&] { return levelset::redistance(smooth); });
  }
}

void repeat(Recorder& out) {
  for (const Sample& at : out.samples()) {
    for (const int times : {1, 10, 100}) {
      if (times == 100 && !out.wantsRepeats(at)) continue;
      const auto many = [&](const auto& once) {
        NarrowBand band = perturbedBand(ball(at.shift, 1), at.voxelSize, at.voxelSize);
        for (int i = 0; i < times; ++i) band = once(band);
        return band;
      };
      const Subject subject{std::to_string(times) + (times == 1 ? " time" : " times"), at,
                            ball(at.shift, 1)};
      out.measure(subject, kOurs, [&] {
        return many([](const NarrowBand& b) { return levelset::redistance(b); });
      });
      if (!(out.isQuick() && times == 100) && out.wantsPeer(at, 8, 1))
        out.measure(subject, peer::kRebuild, [&] { return many(peer::rebuild); });
    }
  }
}

}  // namespace

void addRedistanceCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "redistance",
       .group = "redistancing",
       .title = "a distance again, without moving the surface",
       .definition =
           "φ (1.5 + 0.8 sin(x/4w) sin(y/4w) sin(z/4w)) of a sphere of radius 1, half width 3, "
           "values clipped at the background, is re-distanced once: with w = h, waves that get "
           "shorter with the voxels, so that the same error in voxels is the most that can show, "
           "and with w = 1/16.",
       .citation = "Russo00, Min10",
       .quick = {12, 24, 64},
       .full = {32, 64, 128},
       .bounds = {{"waves of 4 voxels", "band_in_linf_vx", 0.05, 64},
                  {"waves of 4 voxels", "band_out_linf_vx", 0.05, 64},
                  {"waves of 4 voxels", "surface_l1_vx", 1e-3, 64},
                  {"waves of 4 voxels", "order_band_linf", 2, 128, Sense::AtLeast},
                  {"waves of 4 voxels", "checks_failed", 0},
                  {"waves of 4/16", "order_band_l1", 2, 24, Sense::AtLeast},
                  {"waves of 4/16", "order_band_l1", 2, 64, Sense::AtLeast},
                  {"waves of 4/16", "order_band_l1", 2, 128, Sense::AtLeast}},
       .run = mendSlopes});
  all.push_back(
      {.name = "redistance-again",
       .group = "redistancing again and again",
       .title = "once, ten and a hundred times",
       .definition = "The same field, re-distanced over and over: does the surface creep?",
       .citation = "Russo00, Min10",
       .quick = {8, 10, 12},
       .full = {16, 32, 64},
       .bounds = {{"1 time", "surface_l1_vx", 1e-3},
                  {"10 times", "surface_linf_vx", 0.01},
                  {"100 times", "surface_linf_vx", 0.01}},
       .run = repeat});
}

}  // namespace regress
