#include "levelset/solids/offset.h"

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
       .bounds = {{"+10 voxels", "surface_l1_vx", 0.002, 64},
                  {"+10 voxels", "band_in_linf_vx", 0.05, 64},
                  {"+10 voxels", "band_out_linf_vx", 0.05, 64},
                  {"-5 voxels", "surface_l1_vx", 0.002, 64},
                  {"-5 voxels", "band_in_linf_vx", 0.05, 64},
                  {"-5 voxels", "band_out_linf_vx", 0.05, 64}},
       .run = offsetSphere});
  all.push_back(
      {.name = "offset-cube",
       .group = "offset of a cube",
       .title = "a cube shrinks to a cube and grows to a rounded one",
       .definition =
           "The exact band of a cube of edge 1, aligned with the grid and rotated. Inwards by 5 "
           "voxels it is the smaller cube, edges and corners sharp; outwards by 5 it is the cube "
           "with edges rounded by 5 voxels.",
       .citation = "closed form",
       .quick = {14, 20, 32},
       .full = {40, 80, 160},
       .bounds = {{"cube, -5 voxels", "band_in_linf_vx", 0.1, 32},
                  {"cube, -5 voxels", "band_out_linf_vx", 0.1, 32},
                  {"rotated cube, -5 voxels", "band_in_linf_vx", 0.25, 32},
                  {"rotated cube, -5 voxels", "band_out_linf_vx", 0.25, 32},
                  {"cube, -5 voxels", "band_in_linf_vx", 0.1, 80},
                  {"cube, -5 voxels", "band_out_linf_vx", 0.1, 80},
                  {"rotated cube, -5 voxels", "band_in_linf_vx", 0.25, 80},
                  {"rotated cube, -5 voxels", "band_out_linf_vx", 0.25, 80},
                  {"cube, -5 voxels", "band_in_linf_vx", 0.1, 20},
                  {"cube, -5 voxels", "band_out_linf_vx", 0.1, 20},
                  {"cube, -5 voxels", "band_in_linf_vx", 0.1, 40},
                  {"cube, -5 voxels", "band_out_linf_vx", 0.1, 40},
                  {"cube, -5 voxels", "band_in_linf_vx", 0.1, 160},
                  {"cube, -5 voxels", "band_out_linf_vx", 0.1, 160},
                  {"rotated cube, -5 voxels", "band_in_linf_vx", 0.25, 20},
                  {"rotated cube, -5 voxels", "band_out_linf_vx", 0.25, 20},
                  {"rotated cube, -5 voxels", "band_in_linf_vx", 0.25, 40},
                  {"rotated cube, -5 voxels", "band_out_linf_vx", 0.25, 40},
                  {"rotated cube, -5 voxels", "band_in_linf_vx", 0.25, 160},
                  {"rotated cube, -5 voxels", "band_out_linf_vx", 0.25, 160},
                  {"cube, +5 voxels", "band_in_linf_vx", 0.03},
                  {"cube, +5 voxels", "band_out_linf_vx", 0.03},
                  {"rotated cube, +5 voxels", "band_in_linf_vx", 0.03},
                  {"rotated cube, +5 voxels", "band_out_linf_vx", 0.03},
                  {"cube, +5 voxels", "surface_l1_vx", 0.005},
                  {"rotated cube, +5 voxels", "surface_l1_vx", 0.005}},
       .run = offsetCube});
  all.push_back(
      {.name = "offset-laws",
       .group = "offset laws",
       .title = "two offsets are one of their sum; there and back is nothing",
       .definition =
           "Sphere of radius 1 and box 1.6 × 1.2 × 0.8: +3 then +4 voxels must be +7 (deviation), "
           "+5 then −5 must be the solid again, since both are convex.",
       .citation = "closed form",
       .quick = {6, 8, 12},
       .full = {16, 32, 64},
       .bounds = {{"sphere, +3 then +4", "surface_l1_vx", 0.002},
                  {"sphere, +3 then +4", "deviation_vx", 0.002},
                  {"sphere, +5 then -5", "surface_l1_vx", 0.002},
                  {"sphere, +3 then +4", "band_in_linf_vx", 0.005},
                  {"sphere, +3 then +4", "band_out_linf_vx", 0.005},
                  {"sphere, +5 then -5", "band_in_linf_vx", 0.005},
                  {"sphere, +5 then -5", "band_out_linf_vx", 0.005},
                  {"box, +3 then +4", "band_in_linf_vx", 0.05},
                  {"box, +3 then +4", "band_out_linf_vx", 0.05},
                  {"box, +3 then +4", "surface_l1_vx", 0.01},
                  {"box, +5 then -5", "band_in_linf_vx", 0.05},
                  {"box, +5 then -5", "band_out_linf_vx", 0.05}},
       .run = offsetLaws});
}

}  // namespace regress
