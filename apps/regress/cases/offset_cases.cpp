#include "levelset/offset/offset.h"

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"

namespace regress {

using Imath::M44d;
using Imath::V3d;
using levelset::NarrowBand;

namespace {

void offsetSphere(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const NarrowBand solid = exactBand(ball(at.shift, 1), at.voxelSize);
    for (const int voxels : {10, -5}) {
      const double d = voxels * at.voxelSize;
      const Subject subject{voxels > 0 ? "+10 voxels" : "-5 voxels", at, ball(at.shift, 1 + d)};
      out.measure(subject, kOurs, [&] { return levelset::offset(solid, d); });
      if (out.wantsPeer(at, 8, 1))
        out.measure(subject, peer::kFilter, [&] { return peer::offset(solid, d); });
    }
  }
}

Truth turned(const Truth& truth, const V3d& shift) {
  M44d matrix;
  matrix.setTranslation(shift);
  return moved(truth, skewRotation() * matrix);
}

void offsetCube(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const double d = 5 * at.voxelSize;
    const Truth cube = box(V3d(0), V3d(1)), inner = box(V3d(0), V3d(1 - 2 * d)),
                outer = box(V3d(0), V3d(1), d);
    const auto place = [&](const Truth& truth, bool rotated) {
      M44d shift;
      shift.setTranslation(at.shift);
      return rotated ? turned(truth, at.shift) : moved(truth, shift);
    };
    for (const bool rotated : {false, true}) {
      const std::string name = rotated ? "rotated cube, " : "cube, ";
      const NarrowBand solid = exactBand(place(cube, rotated), at.voxelSize);
      const Subject inwards{name + "-5 voxels", at, place(inner, rotated)},
          outwards{name + "+5 voxels", at, place(outer, rotated)};
      out.measure(inwards, kOurs, [&] { return levelset::offset(solid, -d); });
      out.measure(outwards, kOurs, [&] { return levelset::offset(solid, d); });
      if (!out.wantsPeer(at, 14, 1)) continue;
      out.measure(inwards, peer::kFilter, [&] { return peer::offset(solid, -d); });
      out.measure(outwards, peer::kFilter, [&] { return peer::offset(solid, d); });
    }
  }
}

void offsetLaws(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const double h = at.voxelSize;
    for (const bool round : {true, false}) {
      const std::string name = round ? "sphere, " : "box, ";
      const V3d size(1.6, 1.2, 0.8);
      const auto grown = [&](double d) {
        return round ? ball(at.shift, 1 + d) : box(at.shift, size, d);
      };
      const NarrowBand solid = exactBand(grown(0), h);
      const auto sum = out.measure({name + "+3 then +4", at, grown(7 * h)}, kOurs, [&] {
        return levelset::offset(levelset::offset(solid, 3 * h), 4 * h);
      });
      if (sum) out.set("deviation_vx", deviation(*sum, levelset::offset(solid, 7 * h)));
      out.measure({name + "+5 then -5", at, grown(0)}, kOurs,
                  [&] { return levelset::offset(levelset::offset(solid, 5 * h), -5 * h); });
      if (out.wantsPeer(at, 6, 1))
        out.measure({name + "+5 then -5", at, grown(0)}, peer::kFilter,
                    [&] { return peer::offset(peer::offset(solid, 5 * h), -5 * h); });
    }
  }
}

Bounds offsetSphereBounds() {
  return Bounds()
      .measured("+10 voxels", "surface_l1_vx",
                {{8, 0.000196}, {24, 2.07e-5}, {32, 1.24e-5}, {64, 3.5e-6}, {128, 1.08e-6}})
      .measured("+10 voxels", "band_in_linf_vx",
                {{8, 0.00092}, {24, 0.0001}, {32, 6.26e-5}, {64, 1.87e-5}, {128, 1.01e-5}})
      .measured("+10 voxels", "band_out_linf_vx",
                {{8, 0.000922}, {24, 9.99e-5}, {32, 6.26e-5}, {64, 1.97e-5}, {128, 9.55e-6}})
      .measured("-5 voxels", "surface_l1_vx",
                {{8, 0.00281}, {24, 3.96e-5}, {32, 2.03e-5}, {64, 4.45e-6}, {128, 1.2e-6}})
      .measured("-5 voxels", "band_in_linf_vx",
                {{8, 0.000753}, {24, 0.000176}, {32, 9.93e-5}, {64, 2.5e-5}, {128, 1.12e-5}})
      .measured("-5 voxels", "band_out_linf_vx",
                {{8, 0.000889}, {24, 0.00015}, {32, 8.3e-5}, {64, 2.36e-5}, {128, 1.02e-5}});
}

Bounds offsetCubeBounds() {
  return Bounds()
      .rounding("cube, -5 voxels", "band_in_linf_vx", 1.5, 14)
      .rounding("cube, -5 voxels", "band_in_linf_vx", 1.5, 20)
      .rounding("cube, -5 voxels", "band_in_linf_vx", 2, 32)
      .rounding("cube, -5 voxels", "band_in_linf_vx", 1.5, 40)
      .rounding("cube, -5 voxels", "band_in_linf_vx", 1.5, 80)
      .rounding("cube, -5 voxels", "band_in_linf_vx", 1.5, 160)
      .measured("cube, -5 voxels", "band_out_linf_vx", {{14, 0.772}})
      .rounding("cube, -5 voxels", "band_out_linf_vx", 2, 20)
      .rounding("cube, -5 voxels", "band_out_linf_vx", 2, 32)
      .rounding("cube, -5 voxels", "band_out_linf_vx", 2, 40)
      .rounding("cube, -5 voxels", "band_out_linf_vx", 2, 80)
      .rounding("cube, -5 voxels", "band_out_linf_vx", 2, 160)
      .rounding("rotated cube, -5 voxels", "band_in_linf_vx", 1.5, 14)
      .rounding("rotated cube, -5 voxels", "band_in_linf_vx", 2, 20)
      .rounding("rotated cube, -5 voxels", "band_in_linf_vx", 3, 32)
      .rounding("rotated cube, -5 voxels", "band_in_linf_vx", 3, 40)
      .rounding("rotated cube, -5 voxels", "band_in_linf_vx", 3.5, 80)
      .rounding("rotated cube, -5 voxels", "band_in_linf_vx", 3.5, 160)
      .measured("rotated cube, -5 voxels", "band_out_linf_vx",
                {{14, 0.322},
                 {20, 0.000335},
                 {32, 0.000297},
                 {40, 0.000607},
                 {80, 0.00181},
                 {160, 0.000299}})
      .measured("cube, +5 voxels", "band_in_linf_vx",
                {{14, 0.0046}, {40, 0.0046}, {80, 0.0046}, {160, 0.0046}})
      .rounding("cube, +5 voxels", "band_in_linf_vx", 2.5, 32)
      .rounding("cube, +5 voxels", "band_in_linf_vx", 2.5, 20)
      .measured("cube, +5 voxels", "band_out_linf_vx",
                {{14, 0.0046}, {40, 0.0046}, {80, 0.0046}, {160, 0.0046}})
      .rounding("cube, +5 voxels", "band_out_linf_vx", 2.5, 20)
      .rounding("cube, +5 voxels", "band_out_linf_vx", 2, 32)
      .measured(
          "rotated cube, +5 voxels", "band_in_linf_vx",
          {{14, 0.0147}, {20, 0.00492}, {32, 0.00463}, {40, 0.0135}, {80, 0.00589}, {160, 0.0127}})
      .measured(
          "rotated cube, +5 voxels", "band_out_linf_vx",
          {{14, 0.013}, {20, 0.00457}, {32, 0.00467}, {40, 0.015}, {80, 0.0124}, {160, 0.0137}})
      .measured("cube, +5 voxels", "surface_l1_vx",
                {{14, 0.00171},
                 {20, 0.00104},
                 {32, 0.000753},
                 {40, 0.000804},
                 {80, 0.000467},
                 {160, 0.000254}})
      .measured("rotated cube, +5 voxels", "surface_l1_vx",
                {{14, 0.00116},
                 {20, 0.000877},
                 {32, 0.000632},
                 {40, 0.00054},
                 {80, 0.000298},
                 {160, 0.000159}})
      .measured("cube, +5 voxels", "missed_hits", {{14, 0.000795}, {40, 0.000348}})
      .measured("rotated cube, +5 voxels", "missed_hits", {{40, 0.000176}});
}

Bounds offsetLawsBounds() {
  return Bounds()
      .measured("sphere, +5 then -5", "missed_hits", {{16, 0}, {32, 0}, {64, 0}})
      .measured(
          "sphere, +3 then +4", "surface_l1_vx",
          {{6, 0.000347}, {8, 0.000179}, {12, 8.25e-5}, {16, 5.14e-5}, {32, 1.36e-5}, {64, 3.8e-6}})
      .measured("sphere, +3 then +4", "deviation_vx",
                {{6, 0.00178},
                 {8, 0.00116},
                 {12, 0.000566},
                 {16, 0.00035},
                 {32, 0.000103},
                 {64, 2.87e-5}})
      .ceiling(0.002)
      .measured("sphere, +5 then -5", "surface_l1_vx",
                {{6, 0.000558},
                 {8, 0.000288},
                 {12, 0.000118},
                 {16, 6.7e-5},
                 {32, 1.56e-5},
                 {64, 3.76e-6}})
      .measured(
          "sphere, +3 then +4", "band_in_linf_vx",
          {{6, 0.00179}, {8, 0.00101}, {12, 0.00046}, {16, 0.000312}, {32, 9.14e-5}, {64, 2.51e-5}})
      .measured("sphere, +3 then +4", "band_out_linf_vx",
                {{6, 0.00175},
                 {8, 0.000993},
                 {12, 0.000484},
                 {16, 0.000314},
                 {32, 8.92e-5},
                 {64, 2.5e-5}})
      .measured(
          "sphere, +5 then -5", "band_in_linf_vx",
          {{6, 0.00294}, {8, 0.00102}, {12, 0.000469}, {16, 0.00031}, {32, 9.46e-5}, {64, 2.96e-5}})
      .measured("sphere, +5 then -5", "band_out_linf_vx",
                {{6, 0.00291},
                 {8, 0.00112},
                 {12, 0.000495},
                 {16, 0.000294},
                 {32, 9.21e-5},
                 {64, 2.85e-5}})
      .measured("box, +3 then +4", "band_in_linf_vx",
                {{6, 0.0276}, {8, 0.0223}, {12, 0.0207}, {16, 0.0276}, {32, 0.0274}, {64, 0.0268}})
      .measured("box, +3 then +4", "band_out_linf_vx",
                {{6, 0.0275}, {8, 0.0217}, {12, 0.0212}, {16, 0.0275}, {32, 0.0269}, {64, 0.0273}})
      .measured(
          "box, +3 then +4", "surface_l1_vx",
          {{6, 0.00515}, {8, 0.00355}, {12, 0.00322}, {16, 0.00353}, {32, 0.00202}, {64, 0.00138}})
      .measured("box, +5 then -5", "band_in_linf_vx",
                {{6, 0.00684},
                 {8, 0.00119},
                 {12, 0.00041},
                 {16, 0.000216},
                 {32, 0.000282},
                 {64, 0.000202}})
      // Curvature jumps where the roundings of the box begin. Tricubic interpolation is off by up
      // to 0.008 voxel there, so the way back has this error.
      .measured(
          "box, +5 then -5", "band_out_linf_vx",
          {{6, 0.00736}, {8, 0.011}, {12, 0.000818}, {16, 0.00068}, {32, 0.00167}, {64, 0.000299}})
      .measured("sphere, +3 then +4", "missed_hits", {{6, 0.00068}, {16, 0}, {32, 0}, {64, 0}})
      .measured("box, +3 then +4", "missed_hits",
                {{6, 0.000822}, {12, 0}, {16, 0.00057}, {32, 0.000551}, {64, 0.000179}});
}

}  // namespace

void addOffsetCases(std::vector<Case>& all) {
  all.push_back(
      {.name = "offset-sphere",
       .group = "offset",
       .title = "a sphere grows and shrinks",
       .definition = "The exact band of a sphere of radius 1, offset by +10 and by −5 voxels.",
       .citation = "closed form",
       .quick = {8, 24, 64},
       .full = {32, 64, 128},
       .bounds = offsetSphereBounds(),
       .run = offsetSphere});
  all.push_back({.name = "offset-cube",
                 .group = "offset of a cube",
                 .title = "a cube shrinks to a cube and grows to a rounded cube",
                 .definition =
                     "The exact band of a cube of edge 1, aligned with the grid and rotated. The "
                     "inward offset by 5 voxels is the smaller cube with sharp edges and corners. "
                     "The outward offset by 5 voxels is the cube with edges rounded by 5 voxels.",
                 .citation = "closed form",
                 .quick = {14, 20, 32},
                 .full = {40, 80, 160},
                 .bounds = offsetCubeBounds(),
                 .run = offsetCube});
  all.push_back({.name = "offset-laws",
                 .group = "offset laws",
                 .title = "two offsets equal one offset by their sum; out and back gives the solid",
                 .definition = "Sphere of radius 1 and box 1.6 × 1.2 × 0.8: offsets by +3 and then "
                               "+4 voxels must equal one offset by +7; deviation: largest "
                               "difference between the two bands, voxels. Offsets by +5 and then "
                               "−5 voxels must give the solid again, since both solids are convex.",
                 .citation = "closed form",
                 .quick = {6, 8, 12},
                 .full = {16, 32, 64},
                 .bounds = offsetLawsBounds(),
                 .run = offsetLaws});
}

}  // namespace regress
