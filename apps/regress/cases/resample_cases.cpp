#include "levelset/transform/resample.h"

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"

namespace regress {

using Imath::V3d;
using levelset::NarrowBand;

namespace {

/// Resamples a band to voxels of 0.8 times the size and back, `times` times.
template <typename Resample>
NarrowBand chain(NarrowBand band, double voxelSize, int times, const Resample& resample) {
  for (int i = 0; i < times; ++i) {
    band = resample(band, 0.8 * voxelSize);
    band = resample(band, voxelSize);
  }
  return band;
}

void chains(Recorder& out) {
  const auto ours = [](const NarrowBand& b, double h) { return levelset::resample(b, h); };
  for (const Sample& at : out.samples()) {
    for (const int times : {1, 10}) {
      if (times > 1 && !out.wantsRepeats(at)) continue;
      const std::string name = std::to_string(times) + (times == 1 ? " time" : " times");
      for (const bool round : {true, false}) {
        const Truth truth = round ? torus(at.shift, V3d(1, 2, 3), 0.7, 0.3)
                                  : moved(box(at.shift, V3d(1)), skewRotation());
        const Subject subject{(round ? "torus, " : "rotated cube, ") + name, at, truth};
        const NarrowBand solid = exactBand(truth, at.voxelSize);
        out.measure(subject, kOurs, [&] { return chain(solid, at.voxelSize, times, ours); });
        if (out.wantsPeer(at, 6, 1))
          out.measure(subject, peer::kResample,
                      [&] { return chain(solid, at.voxelSize, times, peer::resample); });
      }
    }
  }
}

Bounds resampleChainBounds() {
  return Bounds()
      .required("torus, 1 time", "order_surface", 1.8, 32, Sense::AtLeast)
      .order("torus, 1 time", "order_surface", {{12, 3.58}})
      .measured(
          "torus, 1 time", "band_in_linf_vx",
          {{6, 0.0322}, {8, 0.02}, {12, 0.00803}, {16, 0.00397}, {32, 0.000963}, {64, 0.00023}})
      .measured(
          "torus, 1 time", "band_out_linf_vx",
          {{6, 0.0289}, {8, 0.0186}, {12, 0.0075}, {16, 0.0042}, {32, 0.000979}, {64, 0.000279}})
      .measured("torus, 1 time", "surface_l1_vx",
                {{6, 0.00794},
                 {8, 0.00458},
                 {12, 0.00161},
                 {16, 0.000715},
                 {32, 0.000121},
                 {64, 2.72e-5}})
      .measured("torus, 10 times", "band_in_linf_vx",
                {{6, 0.138}, {16, 0.0215}, {32, 0.00408}, {64, 0.000844}})
      .measured("torus, 10 times", "band_out_linf_vx",
                {{6, 0.136}, {16, 0.0206}, {32, 0.00413}, {64, 0.000864}})
      .measured("torus, 10 times", "surface_l1_vx",
                {{6, 0.0325}, {16, 0.00373}, {32, 0.000482}, {64, 0.000101}})
      .measured("rotated cube, 1 time", "band_in_linf_vx",
                {{6, 0.642}, {8, 0.452}, {12, 0.481}, {16, 0.573}, {32, 0.378}, {64, 0.529}})
      .measured("rotated cube, 1 time", "band_out_linf_vx",
                {{6, 1.01}, {8, 0.755}, {12, 0.979}, {16, 0.848}, {32, 0.807}, {64, 0.86}})
      .ceiling(1.25)
      .measured("torus, 1 time", "missed_hits",
                {{6, 0.00825}, {8, 0.00134}, {16, 0}, {32, 0}, {64, 0}})
      .measured("torus, 10 times", "missed_hits", {{6, 0.0248}, {16, 0.00143}, {32, 0}, {64, 0}})
      .ceiling(0.025)
      .required("torus, 10 times", "order_surface", 1.8, 32, Sense::AtLeast);
}

}  // namespace

void addResampleCases(std::vector<Case>& all) {
  all.push_back({.name = "resample-chain",
                 .group = "resampling",
                 .title = "resampling to finer voxels and back, once and ten times",
                 .definition = "The exact band of a torus (ring radius 0.7, tube radius 0.3, axis "
                               "(1, 2, 3)) and of a rotated cube of edge 1 is resampled to voxels "
                               "of 0.8 times the size and back, once and ten times.",
                 .citation = "closed form",
                 .quick = {6, 8, 12},
                 .full = {16, 32, 64},
                 .bounds = resampleChainBounds(),
                 .run = chains});
}

}  // namespace regress
