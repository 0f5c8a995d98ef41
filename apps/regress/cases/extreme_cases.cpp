#include <cmath>

#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"
#include "levelset/csg/csg.h"
#include "levelset/distance/redistance.h"
#include "levelset/offset/offset.h"
#include "levelset/shapes/shapes.h"

namespace regress {

using Imath::V3d;
using levelset::NarrowBand;

namespace {

/// Samples a sphere with a radius of `at.resolution` voxels, re-distances it and offsets it by
/// three voxels. The errors in voxels must not depend on the position or on the voxel size.
void chainOfThree(Recorder& out, const std::string& variant, const Sample& at, double voxelSize,
                  const V3d& centre) {
  Sample here = at;
  here.voxelSize = voxelSize;
  const double radius = at.resolution * voxelSize;
  out.measure({variant, here, ball(centre, radius + 3 * voxelSize)}, kOurs, [&] {
    const NarrowBand solid = levelset::makeSphere(radius, centre, voxelSize);
    return levelset::offset(levelset::redistance(solid), 3 * voxelSize);
  });
}

void scales(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const V3d off = at.shift / at.voxelSize;  // offset of the centre from a grid point, voxels
    chainOfThree(out, "voxel 1", at, 1, off);
    chainOfThree(out, "voxel 1e-6", at, 1e-6, off * 1e-6);
    chainOfThree(out, "voxel 1e6", at, 1e6, off * 1e6);
    chainOfThree(out, "1e6 voxels from the origin", at, 1, off + V3d(1e6, -1e6, 1e6));
  }
}

void halfWidths(Recorder& out) {
  for (const Sample& at : out.samples()) {
    for (const double width : {1.0, 1.5, 3.0, 50.0}) {
      if (width > 3 && out.isQuick() && (at.phase != kQuickPhase || at.resolution > 6)) continue;
      const Truth truth = ball(at.shift, 1);
      const NarrowBand field = exactBand(truth, at.voxelSize, width);
      std::string name = "half width " + std::to_string(width).substr(0, width > 9 ? 2 : 3);
      // With a half width of 50, the band contains the centre of the sphere, where the closest
      // point is not unique.
      out.measure({name, at, truth}, kOurs,
                  [&] { return levelset::redistance(field, {.halfWidth = width}); });
    }
    // Redistancing widens a band with a half width of three voxels to ten voxels and narrows it
    // again.
    Truth truth = ball(at.shift, 1);
    const NarrowBand narrow = exactBand(truth, at.voxelSize, 3);
    out.measure({"background 10 voxels, band 3", at, truth}, kOurs, [&] {
      NarrowBand widened = levelset::redistance(narrow, {.halfWidth = 10});
      return levelset::redistance(widened, {.halfWidth = 3});
    });
  }
}

/// Torus whose tube radius exceeds its ring radius: an offset torus whose hole has closed. The
/// surface is the outer part of the torus, which meets itself on the axis.
Truth spindle(const V3d& centre, double radius, double tube) {
  const double tip = std::sqrt(tube * tube - radius * radius);
  Truth truth;
  truth.centre = centre;
  truth.reach = radius + tube;
  truth.distance = [=](const V3d& p) {
    const V3d q = p - centre;
    const double away = std::hypot(q.x, q.y), up = std::abs(q.z);
    const double toRing = std::hypot(away - radius, up);
    if (toRing >= tube) return toRing - tube;
    // Inside, the closest point is the foot on the tube's circle if this foot lies on the same side
    // of the axis, otherwise the tip, where the surface meets the axis.
    const double foot = toRing > 0 ? radius + (away - radius) / toRing * tube : radius + tube;
    const double toTip = std::hypot(away, up - tip);
    return -(foot >= 0 ? std::min(tube - toRing, toTip) : toTip);
  };
  return truth;
}

void pastTheAxis(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const NarrowBand ring = exactBand(torus(at.shift, V3d(0, 0, 1), 0.6, 0.2), at.voxelSize);
    Truth truth = spindle(at.shift, 0.6, 0.8);
    const V3d tip(0, 0, std::sqrt(0.8 * 0.8 - 0.6 * 0.6));
    truth.compared = [=](const V3d& p) {
      const V3d q = p - at.shift;
      return (q - tip).length() > 2 * at.voxelSize && (q + tip).length() > 2 * at.voxelSize;
    };
    out.measure({"torus closes its hole", at, truth}, kOurs,
                [&] { return levelset::offset(ring, 0.6); });
    const double gap = 0.3 * at.voxelSize;
    for (const bool touching : {true, false}) {
      const V3d a = at.shift, b = at.shift + V3d(1 + (touching ? 0 : gap), 0, 0);
      const Truth pair = apart(ball(a, 0.5), ball(b, 0.5));
      const std::string name = touching ? "balls that touch" : "balls 0.3 voxels apart";
      const V3d middle = (a + b) / 2.0;
      Truth judged = pair;
      // Near the contact, no grid point lies between the two surfaces, so points within 4 voxels of
      // it are not compared.
      judged.compared = [=](const V3d& p) { return (p - middle).length() > 4 * at.voxelSize; };
      out.measure({"union of " + name, at, judged}, kOurs, [&] {
        return levelset::unite(exactBand(ball(a, 0.5), at.voxelSize),
                               exactBand(ball(b, 0.5), at.voxelSize));
      });
    }
    // Boxes with faces in one plane, which lies on or between grid points, depending on the
    // placement.
    const V3d half(0.5, 1, 1), at0 = at.shift;
    out.measure({"boxes that share a face, united", at, box(at0 + V3d(0.25, 0, 0), V3d(1, 1, 1))},
                kOurs, [&] {
                  return levelset::unite(exactBand(box(at0, half), at.voxelSize),
                                         exactBand(box(at0 + V3d(0.5, 0, 0), half), at.voxelSize));
                });
    out.measure(
        {"box cut by one with three faces in common", at, box(at0 + V3d(-0.25, 0, 0), half)}, kOurs,
        [&] {
          return levelset::subtract(
              exactBand(box(at0, V3d(1)), at.voxelSize),
              exactBand(box(at0 + V3d(0.25, 0, 0), V3d(0.5, 1, 1)), at.voxelSize));
        });
  }
}

void tenMillion(Recorder& out) {
  // A band with the half width w has 4 π R² 2w voxels: ten million at R = 365, w = 3, in voxels.
  if (out.isQuick()) return;
  const Sample at{365, 3, 1.0 / 365, subVoxelPhases()[3] / 365};
  const Truth truth = ball(at.shift, 1);
  const NarrowBand field = levelset::makeSphere(1, at.shift, at.voxelSize);
  out.measure({"re-distanced", at, truth}, kOurs, [&] { return levelset::redistance(field); });
  out.measure({"grown by 3 voxels", at, ball(at.shift, 1 + 3 * at.voxelSize)}, kOurs,
              [&] { return levelset::offset(field, 3 * at.voxelSize); });
}

Bounds scalesBounds() {
  return Bounds()
      .measured("voxel 1", "band_in_linf_vx",
                {{6, 0.00252},
                 {8, 0.000952},
                 {12, 0.000487},
                 {16, 0.000292},
                 {32, 7.96e-5},
                 {64, 2.07e-5}})
      .measured("voxel 1", "band_out_linf_vx",
                {{6, 0.00248},
                 {8, 0.00103},
                 {12, 0.000489},
                 {16, 0.000292},
                 {32, 7.96e-5},
                 {64, 2.07e-5}})
      .measured("voxel 1e-6", "band_in_linf_vx",
                {{6, 0.00252},
                 {8, 0.000952},
                 {12, 0.000487},
                 {16, 0.000292},
                 {32, 7.96e-5},
                 {64, 2.07e-5}})
      .measured("voxel 1e-6", "band_out_linf_vx",
                {{6, 0.00248},
                 {8, 0.00103},
                 {12, 0.000489},
                 {16, 0.000292},
                 {32, 7.96e-5},
                 {64, 2.07e-5}})
      .measured("voxel 1e6", "band_in_linf_vx",
                {{6, 0.00252},
                 {8, 0.000952},
                 {12, 0.000487},
                 {16, 0.000292},
                 {32, 7.96e-5},
                 {64, 2.07e-5}})
      .measured("voxel 1e6", "band_out_linf_vx",
                {{6, 0.00248},
                 {8, 0.00103},
                 {12, 0.000489},
                 {16, 0.000292},
                 {32, 7.96e-5},
                 {64, 2.07e-5}})
      .measured("1e6 voxels from the origin", "band_in_linf_vx",
                {{6, 0.00252},
                 {8, 0.000952},
                 {12, 0.000487},
                 {16, 0.000292},
                 {32, 7.96e-5},
                 {64, 2.07e-5}})
      .measured("1e6 voxels from the origin", "band_out_linf_vx",
                {{6, 0.00248},
                 {8, 0.00103},
                 {12, 0.000489},
                 {16, 0.000292},
                 {32, 7.96e-5},
                 {64, 2.07e-5}});
}

Bounds halfWidthsBounds() {
  return Bounds()
      .measured(
          "half width 1.0", "band_in_linf_vx",
          {{6, 0.0177}, {8, 0.00853}, {12, 0.00603}, {16, 0.00486}, {32, 0.00467}, {64, 0.0039}})
      .measured(
          "half width 1.0", "band_out_linf_vx",
          {{6, 0.0143}, {8, 0.00895}, {12, 0.00573}, {16, 0.00495}, {32, 0.00467}, {64, 0.00345}})
      .measured("half width 1.0", "surface_linf_vx",
                {{6, 0.0265}, {8, 0.0189}, {12, 0.0158}, {16, 0.0142}, {32, 0.0122}, {64, 0.0115}})
      .measured(
          "half width 1.5", "band_in_linf_vx",
          {{6, 0.00863}, {8, 0.00641}, {12, 0.0044}, {16, 0.00306}, {32, 0.00153}, {64, 0.00066}})
      .measured(
          "half width 1.5", "band_out_linf_vx",
          {{6, 0.00897}, {8, 0.00646}, {12, 0.00414}, {16, 0.00295}, {32, 0.00148}, {64, 0.000657}})
      .measured("half width 3.0", "band_in_linf_vx",
                {{6, 0.0017}, {16, 9.85e-5}, {32, 7.15e-6}, {64, 1.63e-5}})
      .rounding("half width 3.0", "band_in_linf_vx", 1.5, 8)
      .rounding("half width 3.0", "band_in_linf_vx", 1.5, 12)
      .measured("half width 3.0", "band_out_linf_vx",
                {{6, 0.00167}, {16, 8.46e-5}, {32, 1.48e-5}, {64, 1.52e-5}})
      .rounding("half width 3.0", "band_out_linf_vx", 1.5, 8)
      .rounding("half width 3.0", "band_out_linf_vx", 1.5, 12)
      .measured("half width 50", "band_out_linf_vx",
                {{6, 0.00171}, {16, 0.000207}, {32, 1.14e-5}, {64, 1.76e-5}})
      .zero("half width 50", "checks_failed")
      .measured("background 10 voxels, band 3", "band_in_linf_vx",
                {{6, 0.00256}, {16, 9.85e-5}, {32, 7.15e-6}, {64, 1.63e-5}})
      .rounding("background 10 voxels, band 3", "band_in_linf_vx", 1.5, 8)
      .rounding("background 10 voxels, band 3", "band_in_linf_vx", 1.5, 12)
      .measured("background 10 voxels, band 3", "band_out_linf_vx",
                {{6, 0.00252}, {8, 0.000791}, {16, 8.46e-5}, {32, 1.48e-5}, {64, 1.52e-5}})
      .rounding("background 10 voxels, band 3", "band_out_linf_vx", 1.5, 12)
      .measured("half width 1.0", "missed_hits",
                {{6, 0.00334}, {16, 0.00047}, {32, 0.000253}, {64, 0.000113}});
}

Bounds contactBounds() {
  return Bounds()
      .measured("torus closes its hole", "surface_l1_vx",
                {{12, 0.00254}, {16, 0.00132}, {24, 0.000508}, {32, 0.000268}, {64, 5.52e-5}})
      .rounding("union of balls that touch", "band_out_linf_vx", 1.5)
      .rounding("union of balls that touch", "band_in_linf_vx", 1.5)
      .rounding("union of balls 0.3 voxels apart", "band_out_linf_vx", 1.5)
      .rounding("union of balls 0.3 voxels apart", "band_in_linf_vx", 1.5)
      .measured("boxes that share a face, united", "band_in_linf_vx",
                {{12, 0.739}, {16, 0.739}, {24, 0.505}, {32, 0.739}, {64, 0.739}})
      .ceiling(0.75)
      .measured("boxes that share a face, united", "band_out_linf_vx",
                {{12, 0.545}, {16, 0.545}, {24, 0.505}, {32, 0.545}, {64, 0.545}})
      .ceiling(0.75)
      .measured("boxes that share a face, united", "surface_linf_vx",
                {{12, 0.51}, {16, 0.602}, {24, 0.492}, {32, 0.591}, {64, 0.566}})
      .ceiling(0.75)
      .measured("boxes that share a face, united", "surface_l1_vx",
                {{12, 0.0285}, {16, 0.0243}, {24, 0.0172}, {32, 0.0135}, {64, 0.00729}})
      .ceiling(0.03)
      .measured("box cut by one with three faces in common", "band_in_linf_vx",
                {{12, 0.111}, {16, 0.141}, {24, 0.111}, {32, 0.141}, {64, 0.141}})
      .measured("box cut by one with three faces in common", "band_out_linf_vx",
                {{12, 0.488}, {16, 0.442}, {24, 0.397}, {32, 0.442}, {64, 0.442}})
      .measured("box cut by one with three faces in common", "surface_linf_vx",
                {{12, 0.319}, {16, 0.315}, {24, 0.239}, {32, 0.305}, {64, 0.299}})
      .measured("box cut by one with three faces in common", "surface_l1_vx",
                {{12, 0.0298}, {16, 0.021}, {24, 0.0137}, {32, 0.0122}, {64, 0.00685}})
      .ceiling(0.03)
      .measured("boxes that share a face, united", "missed_hits",
                {{12, 0.0482}, {16, 0.031}, {24, 0.0242}, {32, 0.0158}, {64, 0.00666}})
      .measured("box cut by one with three faces in common", "missed_hits",
                {{12, 0.0462}, {16, 0.0364}, {24, 0.0235}, {32, 0.0181}, {64, 0.0113}})
      .measured("torus closes its hole", "missed_hits",
                {{12, 0.000757}, {16, 0.000172, Budget::Full}, {24, 0}})
      .measured("boxes that share a face, united", "volume_error",
                {{12, 0.0386}, {16, 0.0221}, {24, 0.00614}, {32, 0.0057}, {64, 0.00177}})
      .measured("box cut by one with three faces in common", "volume_error",
                {{12, 0.0633},
                 {16, 0.0126, Budget::Quick},
                 {16, 0.0365, Budget::Full},
                 {24, 0.00617},
                 {32, 0.00944},
                 {64, 0.0024}});
}

Bounds tenMillionBounds() {
  return Bounds()
      .measured("re-distanced", "band_in_linf_vx", {{365, 3.72e-6}})
      .measured("grown by 3 voxels", "band_out_linf_vx", {{365, 4.45e-6}})
      .required("re-distanced", "peak_bytes", 4e9, 365)
      .required("re-distanced", "active_voxels", 1e7, 365, Sense::AtLeast)
      .required("grown by 3 voxels", "peak_bytes", 4e9, 365);
}

}  // namespace

void addExtremeCases(std::vector<Case>& all) {
  all.push_back({.name = "scales",
                 .group = "scales",
                 .title = "tiny and huge voxels, and a sphere far from the origin",
                 .definition =
                     "A sphere is sampled, re-distanced and grown by three voxels: with voxels of "
                     "1, 1e-6 and 1e6, and with its centre 1e6 voxels from the origin along each "
                     "axis. The resolution is the radius in voxels. The errors must be the same.",
                 .citation = "closed form",
                 .quick = {6, 8, 12},
                 .full = {16, 32, 64},
                 .bounds = scalesBounds(),
                 .run = scales});
  all.push_back(
      {.name = "half-widths",
       .group = "half widths",
       .title = "bands with half widths of 1 to 50 voxels",
       .definition =
           "A sphere of radius 1 with half widths of 1, 1.5, 3 and 50 voxels is re-distanced; a "
           "band of half width 3 is widened to 10 voxels and narrowed again.",
       .citation = "closed form",
       .quick = {6, 8, 12},
       .full = {16, 32, 64},
       .bounds = halfWidthsBounds(),
       .run = halfWidths});
  all.push_back(
      {.name = "contact",
       .group = "contact",
       .title = "surfaces that meet, touch and coincide",
       .definition =
           "A torus (ring radius 0.6, tube radius 0.2) is offset by 0.6 beyond its axis, so that "
           "its hole closes. Balls of radius 0.5 that touch in a point or are 0.3 voxels apart, "
           "are united and compared where the contact is more than 4 voxels away. Boxes with one "
           "or three pairs of coplanar faces are united and subtracted.",
       .citation = "closed form",
       .quick = {12, 16, 24},
       .full = {16, 32, 64},
       .bounds = contactBounds(),
       .run = pastTheAxis});
  all.push_back({.name = "ten-million",
                 .group = "ten million voxels",
                 .title = "ten million active voxels within 4 GB",
                 .definition =
                     "A sphere of radius 365 voxels, half width 3, is re-distanced and grown. Full "
                     "budget only.",
                 .citation = "closed form",
                 .full = {365},
                 .bounds = tenMillionBounds(),
                 .run = tenMillion});
}

}  // namespace regress
