#include "levelset/offset/morphology.h"

#include <fmt/core.h>

#include <array>
#include <cmath>

#include "levelset/csg/csg.h"
#include "levelset/csg/csg_vdb.h"
#include "levelset/error.h"
#include "levelset/vdb.h"

namespace levelset {
namespace {

/// Offsets a solid by `distance` (world units, > 0 for a closing, < 0 for an opening) and back.
/// Unites the result of a closing with the given solid, and intersects the result of an opening
/// with it. Otherwise rounding could move edges at grid points past their original position.
NarrowBand offsetAndBack(const NarrowBand& solid, double distance, const OffsetOptions& options) {
  OffsetOptions first = options, second = options;
  // The second offset recomputes its band anyway, so the first offset uses the default half width.
  first.halfWidth = {};
  first.progress = subProgress(options.progress, 0, 0.5);
  second.progress = subProgress(options.progress, 0.5, 1);
  const NarrowBand back = offset(offset(solid, distance, first), -distance, second);
  if (distance == 0) return back;
  second.progress = {};
  const NarrowBand start = offset(solid, 0, second);
  return makeBand(mergePlain(distance > 0 ? CsgOperation::Union : CsgOperation::Intersection,
                             vdb(start), vdb(back)));
}

void checkRadius(double radius) {
  if (!std::isfinite(radius) || radius < 0)
    throw UsageError(fmt::format("the radius is {}; give a length of zero or more", radius));
}

void checkShell(const NarrowBand& solid, double thickness) {
  if (!std::isfinite(thickness) || thickness <= 0)
    throw UsageError(fmt::format("the thickness is {}; give a length above zero", thickness));
  requireSolid(solid);
  if (solid.isEmpty())
    throw NoSurface("the solid is empty, so there is no surface to thicken; give a solid");
  if (thickness < solid.voxelSize() * (1 - 1e-9))
    throw InvalidInput(
        fmt::format("a wall of {:.4g} is thinner than a voxel of {:.4g}; use a "
                    "thicker wall or smaller voxels",
                    thickness, solid.voxelSize()));
}

/// Offsets the solid inwards by `depth` (world units), to get the cavity of a shell.
NarrowBand cavityOf(const NarrowBand& solid, double depth, const OffsetOptions& options) {
  try {
    return offset(solid, -depth, options);
  } catch (const InvalidInput&) {
    throw InvalidInput(fmt::format(
        "no part of the solid is thicker than twice {:.4g}, so there is no cavity; use a "
        "thinner wall",
        depth));
  }
}

}  // namespace

NarrowBand opening(const NarrowBand& solid, double radius, const OffsetOptions& options) {
  checkRadius(radius);
  return offsetAndBack(solid, -radius, options);
}

NarrowBand closing(const NarrowBand& solid, double radius, const OffsetOptions& options) {
  checkRadius(radius);
  return offsetAndBack(solid, radius, options);
}

// The outer and the inner solid have exact distances and their surfaces do not intersect, so their
// difference has exact distances too.
NarrowBand shell(const NarrowBand& solid, double thickness, ShellSide side,
                 const OffsetOptions& options) {
  checkShell(solid, thickness);
  const double out = side == ShellSide::Out    ? thickness
                     : side == ShellSide::Both ? thickness / 2
                                               : 0;
  OffsetOptions first = options, second = options;
  first.progress = subProgress(options.progress, 0, 0.45);
  second.progress = subProgress(options.progress, 0.45, 0.9);
  const NarrowBand outer = offset(solid, out, first);
  const NarrowBand inner =
      out < thickness ? cavityOf(solid, thickness - out, second) : offset(solid, 0, second);
  const std::array<NarrowBand, 2> walls = {outer, inner};
  CsgOptions csg;
  csg.maxMemory = options.maxMemory;
  csg.progress = subProgress(options.progress, 0.9, 1);
  return combine(CsgOperation::Difference, walls, csg).band;
}

}  // namespace levelset
