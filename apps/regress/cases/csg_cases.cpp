#include "levelset/csg/csg.h"

#include <array>

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"
#include "apps/regress/truth/exact_band.h"

namespace regress {

using Imath::V3d;
using levelset::CsgOperation;
using levelset::NarrowBand;

namespace {

struct Named {
  CsgOperation operation;
  const char* name;
};
constexpr std::array<Named, 3> kOperations = {{{CsgOperation::Union, "union"},
                                               {CsgOperation::Intersection, "intersection"},
                                               {CsgOperation::Difference, "difference"}}};

const V3d kApart(0.9, 0.3, 0.2);

/// Leaves out grid points within 1.5 voxels of the crease, since the crease lies between grid
/// points.
Truth awayFromCrease(Truth truth, const V3d& a, const V3d& b, double radius, double voxelSize) {
  const V3d middle = (a + b) / 2.0, axis = (b - a).normalized();
  const double ring = std::sqrt(radius * radius - (b - a).length2() / 4);
  truth.compared = [=](const V3d& p) {
    const double along = (p - middle).dot(axis);
    return std::hypot((p - middle - along * axis).length() - ring, along) > 1.5 * voxelSize;
  };
  return truth;
}

void combineBalls(Recorder& out) {
  for (const Sample& at : out.samples()) {
    const V3d a = at.shift, b = at.shift + kApart;
    const NarrowBand first = exactBand(ball(a, 1), at.voxelSize),
                     second = exactBand(ball(b, 1), at.voxelSize);
    for (const Named& op : kOperations) {
      const Truth truth = twoBalls(op.operation, a, 1, b, 1);
      const Subject subject{op.name, at, awayFromCrease(truth, a, b, 1, at.voxelSize)};
      const std::array<NarrowBand, 2> both{first, second};
      out.measure(subject, kOurs, [&] { return levelset::combine(op.operation, both).band; });
      if (out.wantsPeer(at, 16))
        out.measure(subject, peer::kCsg,
                    [&] { return peer::combine(op.operation, first, second); });
    }
  }
}

void laws(Recorder& out) {
  using levelset::intersect, levelset::subtract, levelset::unite;
  for (const Sample& at : out.samples()) {
    const double h = at.voxelSize;
    const NarrowBand a = exactBand(ball(at.shift, 1), h),
                     b = exactBand(ball(at.shift + kApart, 1), h),
                     all = exactBand(box(at.shift, V3d(4)), h);
    const auto law = [&](const char* name, const NarrowBand& left, const NarrowBand& right) {
      out.row(name, kOurs, at, {{"voxel_size", h}, {"deviation_vx", deviation(left, right)}});
    };
    law("A ∪ A = A", unite(a, a), a);
    law("A ∩ A = A", intersect(a, a), a);
    law("A ∪ B = B ∪ A", unite(a, b), unite(b, a));
    law("A ∩ B = B ∩ A", intersect(a, b), intersect(b, a));
    law("X \\ (A ∪ B) = (X \\ A) ∩ (X \\ B)", subtract(all, unite(a, b)),
        intersect(subtract(all, a), subtract(all, b)));
    law("X \\ (A ∩ B) = (X \\ A) ∪ (X \\ B)", subtract(all, intersect(a, b)),
        unite(subtract(all, a), subtract(all, b)));
    if (at.phase == kQuickPhase)
      out.expectRefusal("A \\ A at " + std::to_string(at.resolution), levelset::ExitCode::Input,
                        [&] { (void)subtract(a, a); });
  }
}

/// The position of the crease between grid points is known to a third of a voxel, which limits the
/// band where the crease is nearest.
Bounds csgBallsBounds() {
  return Bounds()
      .measured("union", "band_in_linf_vx",
                {{12, 0.0412}, {16, 0.0539}, {32, 0.0557, Budget::Quick}})
      .unmeasured("union", "band_in_linf_vx", 0.1, {32, 64, 128, 256})
      .rounding("union", "band_out_linf_vx", 1.5)
      .measured("union", "band_in_l1_vx",
                {{12, 0.000443}, {16, 0.000239}, {32, 6.5e-5, Budget::Quick}})
      .unmeasured("union", "band_in_l1_vx", 0.01, {32})
      .rounding("union", "band_out_l1_vx", 0.5)
      .zero("union", "checks_failed")
      .rounding("intersection", "band_in_linf_vx", 1.5)
      .measured("intersection", "band_out_linf_vx",
                {{12, 0.0527}, {16, 0.0507}, {32, 0.0287, Budget::Quick}})
      .unmeasured("intersection", "band_out_linf_vx", 0.4, {32, 64, 128, 256})
      .rounding("intersection", "band_in_l1_vx", 0.5)
      .measured("intersection", "band_out_l1_vx",
                {{12, 0.00153}, {16, 0.000493}, {32, 0.000135, Budget::Quick}})
      .unmeasured("intersection", "band_out_l1_vx", 0.01, {32})
      .zero("intersection", "checks_failed")
      .rounding("difference", "band_in_linf_vx", 1.5)
      .measured("difference", "band_out_linf_vx",
                {{12, 0.277}, {16, 0.128}, {32, 0.322, Budget::Quick}})
      .ceiling(0.4)
      .unmeasured("difference", "band_out_linf_vx", 0.4, {32, 64, 128, 256})
      .rounding("difference", "band_in_l1_vx", 0.5)
      .measured("difference", "band_out_l1_vx",
                {{12, 0.00122}, {16, 0.00072}, {32, 0.000367, Budget::Quick}})
      .unmeasured("difference", "band_out_l1_vx", 0.01, {32})
      .zero("difference", "checks_failed")
      .measured("union", "volume_error",
                {{12, 0.000131}, {16, 6.93e-6}, {32, 1.92e-5, Budget::Quick}})
      .unmeasured("union", "volume_error", 0.002, {64})
      .measured("intersection", "volume_error",
                {{12, 0.00118}, {16, 0.000522}, {32, 0.000101, Budget::Quick}})
      .unmeasured("intersection", "volume_error", 0.002, {64})
      .measured("difference", "volume_error",
                {{12, 0.0094}, {16, 0.00447}, {32, 0.00236, Budget::Quick}})
      .unmeasured("difference", "volume_error", 0.002, {64});
}

Bounds csgLawsBounds() {
  return Bounds()
      .zero("A ∪ A = A", "deviation_vx")
      .zero("A ∩ A = A", "deviation_vx")
      .zero("A ∪ B = B ∪ A", "deviation_vx")
      .zero("A ∩ B = B ∩ A", "deviation_vx")
      .zero("X \\ (A ∪ B) = (X \\ A) ∩ (X \\ B)", "deviation_vx")
      .zero("X \\ (A ∩ B) = (X \\ A) ∪ (X \\ B)", "deviation_vx");
}

}  // namespace

void addCsgCases(std::vector<Case>& all) {
  all.push_back({.name = "csg-balls",
                 .group = "CSG",
                 .title = "union, intersection and difference of two balls as distances",
                 .definition =
                     "Two spheres of radius 1 whose centres are (0.9, 0.3, 0.2) apart. The exact "
                     "distance is the distance to the nearest part of the two spheres or of the "
                     "circle between them. Volume and area follow from spherical caps. The band's "
                     "errors leave out grid points within 1.5 voxels of the circle.",
                 .citation = "closed form",
                 .quick = {12, 16, 32},
                 .full = {32, 64, 128, 256},
                 .bounds = csgBallsBounds(),
                 .run = combineBalls});
  all.push_back(
      {.name = "csg-laws",
       .group = "CSG laws",
       .title = "idempotence, commutativity, De Morgan",
       .definition =
           "The same balls, and a box of edge 4 around them. deviation: largest difference between "
           "the bands of both sides, in voxels. It is zero to the bit.",
       .citation = "set algebra",
       .quick = {8, 12, 16},
       .full = {16, 32, 64},
       .bounds = csgLawsBounds(),
       .run = laws});
}

}  // namespace regress
