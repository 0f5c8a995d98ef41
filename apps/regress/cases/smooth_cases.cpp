#include "levelset/curvature/smooth.h"

#include <cmath>
#include <numbers>

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"

namespace regress {

using levelset::NarrowBand;
using levelset::SmoothKind;

namespace {

/// Mean of |x + σξ| at |x| = r, ξ standard normal in space: the distance from the origin, convolved
/// with a Gaussian.
double meanLength(double r, double sigma) {
  const double u = r / (sigma * std::numbers::sqrt2);
  return sigma * std::sqrt(2 / std::numbers::pi) * std::exp(-u * u) +
         (r + sigma * sigma / r) * std::erf(u);
}

/// The radius at which that is `radius`: there is the zero set of the convolved |x| − radius. The
/// mean rises with r, and is larger than r.
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
    // Four boxes of three voxels have a variance of 8/3.
    const Subject same = subject("σ = 1.63 voxels", theirs);
    out.measure(same, kOurs, ours(theirs));
    if (out.wantsPeer(at, 16, 1))
      out.measure(same, peer::kFilter, [&] { return peer::gaussian(solid); });
  }
}

std::vector<Bound> smoothBounds() {
  std::vector<Bound> bounds;
  for (const char* variant : {"σ = 1 voxel", "σ = 1.63 voxels"}) {
    bounds.push_back({variant, "surface_linf_vx", 0.02});
    bounds.push_back({variant, "band_in_linf_vx", 0.05});
    bounds.push_back({variant, "band_out_linf_vx", 0.05});
    bounds.push_back({variant, "checks_failed", 0});
  }
  return bounds;
}

}  // namespace

void addSmoothCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "smooth",
       .group = "smoothing",
       .title = "a sphere's distance under a Gaussian",
       .definition =
           "|x| − R of a sphere of radius R = 1, convolved with a Gaussian of σ and made a "
           "distance "
           "again: a sphere of the radius r at which the mean of |x + σξ|, ξ standard normal, is "
           "R. In space that mean is σ √(2/π) exp(−r² / 2σ²) + (r + σ²/r) erf(r / σ√2), about r + "
           "σ²/r. σ is one voxel, and √(8/3), which OpenVDB's four passes of a box of three voxels "
           "come to.",
       .citation = "closed form",
       .quick = {6, 12, 24},
       .full = {16, 64, 256},
       .bounds = smoothBounds(),
       .run = smoothSphere});
}

}  // namespace regress
