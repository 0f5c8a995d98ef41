#include "levelset/curvature_flow/smooth.h"

#include <cmath>
#include <numbers>

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"

namespace regress {

using levelset::NarrowBand;
using levelset::SmoothKind;

namespace {

/// Mean of |x + σξ| at |x| = r, ξ standard normal in space. This is the distance from the origin,
/// convolved with a Gaussian.
double meanLength(double r, double sigma) {
  const double u = r / (sigma * std::numbers::sqrt2);
  return sigma * std::sqrt(2 / std::numbers::pi) * std::exp(-u * u) +
         (r + sigma * sigma / r) * std::erf(u);
}

/// Radius r at which meanLength() equals `radius`. The zero set of the convolved |x| − radius lies
/// at r. The mean rises with r and exceeds r.
double smoothedRadius(double radius, double sigma) {
  double low = 0, high = radius;
  while (high - low > 1e-12 * radius) {
    const double middle = 0.5 * (low + high);
    (meanLength(middle, sigma) < radius ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

void smoothSphere(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const NarrowBand solid = exactBand(ball(at.shift, 1), at.voxelSize);
    const auto subject = [&](const char* variant, double sigma) {
      return Subject{variant, at, ball(at.shift, smoothedRadius(1, sigma))};
    };
    const double h = at.voxelSize, theirs = std::sqrt(8.0 / 3) * h;
    const auto ours = [&](double sigma) {
      return [&, sigma] { return levelset::smooth(solid, SmoothKind::Gaussian, sigma); };
    };
    out.measure(subject("σ = 1 voxel", h), kOurs, ours(h));
    // The four box filters of OpenVDB, three voxels wide each, have a variance of 8/3 voxels².
    const Subject same = subject("σ = 1.63 voxels", theirs);
    out.measure(same, kOurs, ours(theirs));
    if (out.wantsPeer(at, 16, 1))
      out.measure(same, peer::kFilter, [&] { return peer::gaussian(solid); });
  }
}

Bounds smoothBounds() {
  return Bounds()
      .measured("σ = 1.63 voxels", "missed_hits", {{16, 0.000314}, {64, 0}, {256, 0}})
      .measured("σ = 1 voxel", "surface_linf_vx",
                {{6, 0.00236},
                 {12, 0.000759},
                 {24, 0.000431},
                 {16, 0.000597},
                 {64, 0.000387},
                 {256, 0.000378}})
      .measured("σ = 1 voxel", "band_in_linf_vx",
                {{6, 0.00167},
                 {12, 0.000664},
                 {24, 0.000473},
                 {16, 0.000556},
                 {64, 0.00101},
                 {256, 0.00155}})
      .measured("σ = 1 voxel", "band_out_linf_vx",
                {{6, 0.0018},
                 {12, 0.0007},
                 {24, 0.000477},
                 {16, 0.000558},
                 {64, 0.000964},
                 {256, 0.00185}})
      .zero("σ = 1 voxel", "checks_failed")
      .measured("σ = 1.63 voxels", "surface_linf_vx",
                {{6, 0.00277},
                 {12, 0.000558},
                 {24, 0.000142},
                 {16, 0.00032},
                 {64, 2.25e-5},
                 {256, 2.22e-6}})
      .measured("σ = 1.63 voxels", "band_in_linf_vx",
                {{6, 0.00187},
                 {12, 0.000434},
                 {24, 0.000109},
                 {16, 0.000242},
                 {64, 1.75e-5},
                 {256, 4.39e-6}})
      .measured("σ = 1.63 voxels", "band_out_linf_vx",
                {{6, 0.00186},
                 {12, 0.00043},
                 {24, 0.000109},
                 {16, 0.000242},
                 {64, 1.86e-5},
                 {256, 5.62e-6}})
      .zero("σ = 1.63 voxels", "checks_failed")
      .measured("σ = 1 voxel", "missed_hits", {{6, 0.00114}, {16, 0.000157}, {64, 0}, {256, 0}});
}

}  // namespace

void addSmoothCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "smooth",
       .group = "smoothing",
       .title = "the distance of a sphere, smoothed by a Gaussian",
       .definition =
           "|x| − R of a sphere of radius R = 1, convolved with a Gaussian of σ and re-distanced, "
           "gives a sphere of the radius r at which the mean of |x + σξ|, ξ standard normal, is "
           "R. In space that mean is σ √(2/π) exp(−r² / 2σ²) + (r + σ²/r) erf(r / σ√2), about r + "
           "σ²/r. σ is one voxel, and √(8/3), which equals four passes of OpenVDB's box filter of "
           "three voxels.",
       .citation = "closed form",
       .quick = {6, 12, 24},
       .full = {16, 64, 256},
       .bounds = smoothBounds(),
       .run = smoothSphere});
}

}  // namespace regress
