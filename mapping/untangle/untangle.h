#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "mapping/patches/patch.h"

/// Patches whose particles are moved so that the map through them folds less, or stretches less:
/// those of the surface slide on it, those above are free, and those of the rims follow their
/// neighbours.
namespace mapping {

struct UntangleOptions {
  double embedDepth = 0;   ///< how far the texture lies below the surface, in w
  bool freeSides = false;  ///< the sides slide on the surface too; else they stay
  /// Size of the unit cube at rest; empty: that of the patch, so that the proportions that were
  /// asked for are no distortion. For the distortion the unit does not matter.
  std::optional<Imath::V3d> proportions = {};
  std::size_t mostIterations = 1000;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// Cells of the shell in which the straight map through the particles (or one of a cell's six
/// tetrahedra) turns over or has no volume, and the least determinant.
struct FoldCount {
  std::size_t folded = 0, cells = 0;
  double leastJacobian = 0;  ///< at the corners and in the tetrahedra of the cells; 1 at rest
};
[[nodiscard]] FoldCount countFolds(const Patch& patch, double embedDepth = 0);

struct Untangling {
  Patch patch;  ///< the given one, to the bit, where it did not fold, or nothing was mended
  FoldCount before, after;
  std::size_t iterations = 0;
  double farthestMove = 0;  ///< of a particle, world units
  [[nodiscard]] bool isUntangled() const { return after.folded == 0; }
};

/// Moves particles until no cell folds: the least of an energy that is finite for folds and forbids
/// them in the limit [Garanzha21]. Where the sides of the patch themselves cross on the surface, no
/// place of the other particles mends that: the patch with the fewest folds is returned.
/// @param base  the solid that the patch was made on
/// @throws InvalidInput for a patch without layers, with particles that are not finite, or one that
///         does not lie on the base; ResourceLimit; Cancelled
[[nodiscard]] Untangling untangle(const levelset::NarrowBand& base, const Patch& patch,
                                  const UntangleOptions& options = {});

/// What the symmetric Dirichlet energy of a shell's elements is, against a box of given proportions
/// in the size at which it is least: 6 for a map that keeps proportions.
struct ElementDistortion {
  double mean = 0;  ///< by volume at rest: what is minimised
  double median = 0, percent99 = 0, most = 0;
};

struct DistortionGain {
  Patch patch;
  ElementDistortion before, after;
  std::size_t iterations = 0;
  double farthestMove = 0;  ///< world units
};

/// Moves particles to the least symmetric Dirichlet energy [Smith15] over the whole shell, see
/// ElementDistortion. It falls with every step, and a fold is never made.
/// @throws InvalidInput as above, and for a patch that folds: untangle it first
[[nodiscard]] DistortionGain minimiseDistortion(const levelset::NarrowBand& base,
                                                const Patch& patch,
                                                const UntangleOptions& options = {});

}  // namespace mapping
