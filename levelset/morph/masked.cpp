#include "levelset/morph/masked.h"

#include "levelset/distance/redistance.h"
#include "levelset/morph/morph.h"

namespace levelset {
namespace {

/// Voxels added to the largest displacement of the surface. The morph clips distances at the sum.
constexpr double kBeyondMoved = 8;

}  // namespace

NarrowBand masked(const NarrowBand& solid, const Mask& mask, double farthest,
                  const std::function<NarrowBand(const Progress&)>& change,
                  const MaskedOptions& options) {
  const NarrowBand changed = change(subProgress(options.progress, 0, 0.5));
  NarrowBand result = morph(solid, changed,
                            {
                                .mask = mask,
                                .farthest = farthest / solid.voxelSize() + kBeyondMoved,
                                .maxMemory = options.maxMemory,
                                .progress = subProgress(options.progress, 0.5, 0.9),
                            });
  if (!options.halfWidth) return result;
  return redistance(std::move(result), {.halfWidth = options.halfWidth,
                                        .maxMemory = options.maxMemory,
                                        .progress = subProgress(options.progress, 0.9, 1)});
}

}  // namespace levelset
