#pragma once

#include <Imath/ImathVec.h>

#include <cstddef>
#include <optional>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "mapping/patches/patch.h"

/// Moves the particles of a patch so that the map through them has fewer folds or less distortion.
/// Particles on the surface slide on it, particles above it are free, and rim particles follow
/// their neighbours.
namespace mapping {

struct UntangleOptions {
  /// Depth of the texture below the surface, in w; negative: its lift above w = 1.
  double embedDepth = 0;
  /// True: particles on the sides of the layer at w = 0 slide on the surface too; false: they stay.
  bool freeSides = false;
  /// Size of the unit cube of u, v, w in the undeformed (rest) box, world units. Empty: the size of
  /// the patch, so that its proportions do not count as distortion. For minimiseDistortion() only
  /// the ratios of the three sizes matter.
  std::optional<Imath::V3d> proportions = {};
  std::size_t mostIterations = 1000;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// Number of cells (PrismCells) in which the trilinear map through the particles, or one of the
/// cell's six tetrahedra, is inverted or has no volume. Cells where this cannot be excluded count
/// too.
struct FoldCount {
  std::size_t folded = 0, cells = 0;
  /// Least Jacobian determinant at the corners of cells and in their tetrahedra; 1 for the rest
  /// box: the mean lengths of the patch, or `proportions` if given.
  double leastJacobian = 0;
};
[[nodiscard]] FoldCount countFolds(const Patch& patch, double embedDepth = 0);

struct Untangling {
  /// Equal to the input patch, bit for bit, if it had no folds or none could be removed.
  Patch patch;
  FoldCount before, after;
  std::size_t iterations = 0;
  double farthestMove = 0;  ///< largest displacement of a particle, world units
  [[nodiscard]] bool isUntangled() const { return after.folded == 0; }
};

/// Moves particles until no cell folds, by minimising foldoverEnergy(). This energy is finite for
/// folds and forbids them in the limit ε → 0 of its parameter [Garanzha21]. If the sides of the
/// patch cross each other on the surface, no position of the other particles removes that fold,
/// unless `freeSides` is set. If folds remain, the last patch is returned if it has fewer folds
/// than the input, otherwise the input.
/// @param base  the solid on which the patch was built
/// @throws InvalidInput for a patch without layers, with particles that are not finite, or that
///         does not lie on the base
/// @throws UsageError for an embedding depth or proportions that are not finite, or proportions
///         that are not positive
/// @throws ResourceLimit if the memory estimate exceeds `maxMemory`
/// @throws Cancelled if the progress callback cancels
[[nodiscard]] Untangling untangle(const levelset::NarrowBand& base, const Patch& patch,
                                  const UntangleOptions& options = {});

/// Symmetric Dirichlet energy of the elements (PrismElements) of a patch, relative to an undeformed
/// (rest) box of the given proportions. The size of the box is the one with the least energy. A map
/// that keeps the proportions has energy 6.
struct ElementDistortion {
  /// Mean over the elements, weighted by their volumes in the rest box; this mean is minimised.
  double mean = 0;
  double median = 0, percent99 = 0, most = 0;
};

struct DistortionGain {
  Patch patch;
  ElementDistortion before, after;
  std::size_t iterations = 0;
  double farthestMove = 0;  ///< largest displacement of a particle, world units
};

/// Moves particles to minimise the symmetric Dirichlet energy [Smith15] over all elements, see
/// ElementDistortion. The energy decreases in every step. If folds appear between the elements, the
/// last patch without folds is returned.
/// @throws InvalidInput as untangle(), and for a patch that folds: untangle it first
/// @throws UsageError, ResourceLimit, Cancelled as untangle()
[[nodiscard]] DistortionGain minimiseDistortion(const levelset::NarrowBand& base,
                                                const Patch& patch,
                                                const UntangleOptions& options = {});

}  // namespace mapping
