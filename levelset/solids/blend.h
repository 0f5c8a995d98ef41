#pragma once

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "levelset/solids/csg.h"

namespace levelset {

enum class BlendSide {
  Both,
  Add,    ///< material is only added
  Remove  ///< material is only removed
};

struct BlendOptions {
  BlendSide side = BlendSide::Both;
  std::size_t maxMemory = kNoMemoryLimit;
  Progress progress = {};
};

/// CSG and its rounding in one, by curvature flow localised along the curve in which the two zero
/// sets meet [Museth02, Brodersen07 §6.3]: φ_t = D(d) κ |∇φ|, where d is the distance to the curve and
/// D falls smoothly from 1 to 0 at `radius`. Stops when the crease has taken that radius. Nothing
/// changes further than `radius` from the curve, so solids that are near but do not meet stay apart.
/// @param radius  world units, ≥ 0; 0 is plain CSG
[[nodiscard]] CsgResult blend(CsgOperation operation, const NarrowBand& a, const NarrowBand& b,
                              double radius, const BlendOptions& options = {});

}  // namespace levelset
