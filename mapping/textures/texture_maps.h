#pragma once

// Private to geometric textures: the maps of the patches and their measurements.

#include <ctime>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "mapping/maps/patch_map.h"
#include "mapping/textures/geometric_texture.h"

namespace mapping {

/// Number of result voxels by which the texture's band must extend on each side of its surface. The
/// high-order interpolant at the zero set then reads only distances, no background values.
inline constexpr double kTextureBandNeeded = 3;

/// Calls `work` and adds its CPU time to `seconds`.
/// @return the result of `work`
template <typename Work>
auto timed(double& seconds, const Work& work) {
  const std::clock_t start = std::clock();
  auto result = work();
  seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  return result;
}

/// Map of one patch, of the kind TextureOptions::map, with its measurements; `map` is empty for a
/// skipped patch.
struct ChosenMap {
  std::unique_ptr<PatchMap> map;
  Distortion distortion = {};
  FoldCertificate certificate = {};
  std::size_t particles = 0;
  Imath::V3d residual{0};  ///< largest residuals at the particles, in u, v and w
  /// Number of sample points where the patch passes through itself without folding.
  std::size_t overlaps = 0;
  MapSample overlap = {};  ///< one sample point where the patch passes through itself
  RbfSolveReport solve = {};
  bool isExtrapolated = false;  ///< true: no particles support the map below the surface

  /// Stretch that determines the voxel size: the least stretch where the texture is visible.
  /// Isolated folds do not count, nor do parts embedded in the base that a crease compresses.
  [[nodiscard]] double leastStretch(TextureMerge merge) const {
    if (distortion.folded > 0) return distortion.stretch.percent1;
    return merge == TextureMerge::Union ? distortion.leastAbove : distortion.stretch.least;
  }
};

/// Mapped box of a texture, and the depth of the texture below the surface, world units.
struct TextureExtent {
  Imath::Box3d box;
  double embedDepth = 0;
};

/// Builds and certifies the maps of all patches; a skipped patch gets no map. Other folds are
/// errors, or notes if folds are allowed. Adds the measurements to the report.
/// @param use  if given, called with the number of each patch that is not skipped, as soon as its
///         map is certified; the map is then freed
/// @throws InvalidInput for folds that are not allowed, and if all patches were skipped
/// @throws NumericalError if the iterative solver of an RBF map stagnates
/// @throws ResourceLimit if the memory estimate exceeds the limit
[[nodiscard]] std::vector<ChosenMap> makeMaps(const levelset::NarrowBand& base,
                                              const levelset::NarrowBand& texture,
                                              std::span<const Patch> patches,
                                              const TextureExtent& extent,
                                              const TextureOptions& options, TextureReport& report,
                                              const std::function<void(std::size_t)>& use = {});

}  // namespace mapping
