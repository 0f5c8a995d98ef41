#include "levelset/shapes/shapes.h"

#include "apps/regress/peers/peer.h"
#include "apps/regress/recorder.h"

namespace regress {

using Imath::V3d;

namespace {

void sampleShapes(Recorder& out) {
  const V3d axis(1, 2, 3);
  for (const Sample& at : out.samples()) {
    const V3d c = at.shift;
    const double h = at.voxelSize;
    const Subject sphere{"sphere", at, ball(c, 1)};
    out.measure(sphere, kOurs, [&] { return levelset::makeSphere(1, c, h); });
    if (out.wantsPeer(at, 16))
      out.measure(sphere, peer::kShapes, [&] { return peer::sphere(1, c, h); });

    const V3d size(1.6, 1.2, 0.8);
    const Subject cuboid{"box", at, box(c, size)};
    out.measure(cuboid, kOurs, [&] { return levelset::makeBox(size, c, h); });
    if (out.wantsPeer(at, 16))
      out.measure(cuboid, peer::kShapes, [&] { return peer::box(size, c, h); });

    out.measure({"torus", at, torus(c, axis, 0.7, 0.3)}, kOurs,
                [&] { return levelset::makeTorus(0.7, 0.3, c, axis, h); });
    out.measure({"cylinder", at, cylinder(c, axis, 0.5, 1.2)}, kOurs,
                [&] { return levelset::makeCylinder(0.5, 1.2, c, axis, h); });
    const V3d from = c - axis * 0.12, to = c + axis * 0.12;
    out.measure({"capsule", at, capsule(from, to, 0.4)}, kOurs,
                [&] { return levelset::makeCapsule(from, to, 0.4, h); });
  }
}

/// Voxels are floats. The volume error of the sphere is at their rounding level, so it has no order
/// of convergence.
Bounds shapesBounds() {
  return Bounds()
      .rounding("sphere", "band_in_linf_vx", 1.5)
      .rounding("sphere", "band_out_linf_vx", 1.5)
      .rounding("box", "band_in_linf_vx", 1.5)
      .rounding("box", "band_out_linf_vx", 1.5)
      .rounding("torus", "band_in_linf_vx", 1.5)
      .rounding("torus", "band_out_linf_vx", 1.5)
      .rounding("cylinder", "band_in_linf_vx", 1.5)
      .rounding("cylinder", "band_out_linf_vx", 1.5)
      .rounding("capsule", "band_in_linf_vx", 1.5)
      .rounding("capsule", "band_out_linf_vx", 1.5)
      .rounding("sphere", "volume_error", 3)
      .order("torus", "order_volume", {{24, 4.05}, {32, 4.07}});
}

}  // namespace

void addShapeCases(std::vector<Case>& all) {
  all.push_back({.name = "shapes",
                 .group = "shapes",
                 .title = "sampled shapes have exact distances",
                 .definition =
                     "Sphere of radius 1, box 1.6 × 1.2 × 0.8, and about the axis (1, 2, 3) a "
                     "torus of ring radius 0.7 and tube radius 0.3, a cylinder of radius 0.5 and "
                     "height 1.2 and a capsule of radius 0.4, against their closed forms on both "
                     "sides. The remaining error of the surface is that of tricubic interpolation.",
                 .citation = "closed forms",
                 .quick = {8, 16, 24},
                 .full = {16, 32, 64},
                 .bounds = shapesBounds(),
                 .run = sampleShapes});
}

}  // namespace regress
