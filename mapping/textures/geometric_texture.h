#pragma once

#include <Imath/ImathBox.h>

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "mapping/distortion/distortion.h"
#include "mapping/distortion/fold_certificate.h"
#include "mapping/patches/patch.h"
#include "mapping/rbf/rbf_map.h"

/// Any solid laid onto a patch of any surface as a level set [Brodersen07 §8.3, §8.5].
namespace mapping {

enum class TextureMerge {
  Union,  ///< stands on the surface
  Carve,  ///< is cut out of it
  Alone   ///< only the warped texture
};

enum class TextureMap {
  Rbf,   ///< smooth, defined everywhere, relaxed by λ
  Prism  ///< straight in tetrahedra between the particles, which have to be dense
};

struct TextureOptions {
  TextureMerge merge = TextureMerge::Union;
  TextureMap map = TextureMap::Rbf;
  std::optional<double> embedDepth =
      {};            ///< how deep the texture dips below the surface, world units; empty: one voxel
  double blend = 0;  ///< radius along the seam, world units; 0: none
  std::optional<Imath::Box3d> textureBox =
      {};  ///< what the unit cube of u, v, w is; empty: the texture's zero-set box. What is outside
           ///< goes on beyond the patch, but not in a shell: there it is cut off. A box that holds
           ///< all of the texture cuts nothing
  std::optional<double> voxelSize =
      {};                      ///< empty: the finest of base and texture × smallest stretch
  double halfWidth = 3;        ///< voxels
  RbfMapOptions rbf = {};      ///< but for solveTolerance, a tenth of mapTolerance
  double mapTolerance = 0.05;  ///< of the map's fast evaluation, texture voxels
  bool allowFolds = false;
  bool skipFolds = false;  ///< of many patches, leave out those that fold
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// Where the CPU time went, seconds of all threads.
struct TextureCost {
  double setup = 0;        ///< solving for the map, or building its tetrahedra
  double certificate = 0;  ///< surveying the distortion, and proving where there is no fold
  double mapping = 0;      ///< the texture at the grid points
  double distance = 0;     ///< making distances of it
  double merging = 0;      ///< with the other pieces and the base
};

/// Of all patches together; distortion is that of the worst.
struct TextureReport {
  double voxelSize = 0;
  std::size_t patches = 0, skipped = 0;  ///< mapped, and left out because they fold
  std::size_t particles = 0, blocksTested = 0, blocksEvaluated = 0;
  /// Particles added up or tetrahedra tried, for each grid point of the blocks evaluated.
  double operationsPerPoint = 0;
  Distortion distortion = {};
  FoldCertificate certificate = {};
  double mapResidual = 0;  ///< largest |Φ(p) − uvw| × texture size, world units
  /// How far the map's fast evaluation was off at grid points drawn at random, texture voxels.
  double mapError = 0;
  std::size_t mapErrorPoints = 0;
  RbfSolveReport solve = {};  ///< of an RBF map
  TextureCost cost = {};
  std::vector<std::string> notes;
};

struct TextureResult {
  levelset::NarrowBand band;
  TextureReport report;
};

/// Voxel size of a result for which none is asked: the texture's where the map squeezes it below
/// the base's, else the base's own. @param minStretch  of texture → patch
[[nodiscard]] double resultVoxelSize(double base, double texture, double minStretch);

/// The map of a patch: through its particles, those of its rims too, to their texture coordinates,
/// λ near for w = 0. Without the rims the map errs most beside the patch's sides; and beyond its
/// first and last layer, so that where the texture is sunk columns go straight on by as many
/// layers.
/// @param sink  as a share of the patch's height; negative: beyond the last layer
[[nodiscard]] RbfMap patchToTexture(const Patch& patch, const RbfMapOptions& options = {},
                                    double embedDepth = 0);

/// A map, and whether it folds.
struct CertifiedRbf {
  std::unique_ptr<RbfMap> map;
  std::vector<MapSample> samples;
  FoldCertificate certificate;
  bool isExtrapolated = false;
};

/// The map of a patch for a texture that is sunk; where columns that go straight on would fold it,
/// as below a crease, and without them it does not fold, the map that goes on by itself.
/// @param cost  its setup and certificate are added to
[[nodiscard]] CertifiedRbf certifiedRbf(const Patch& patch, double embedDepth,
                                        const RbfMapOptions& options, TextureCost& cost);

/// @throws InvalidInput, telling where, when the patch's surface is not the base's
void requirePatchOn(const levelset::NarrowBand& base, const Patch& patch);

/// Warps `texture` into the patch, re-distances it [Brodersen07 §8.3], and merges it with `base`.
/// Where the texture, squeezed by the map, has voxels no finer than the base's, the result has the
/// base's own grid.
/// @param base     the solid that the patch was made on
/// @param texture  any solid; x, y, z of its box become u, v, w
/// @throws UsageError for lengths that are negative or not finite; InvalidInput when the map folds
/// (with the place), the patch does not lie on `base`, or the
///         texture box is empty; NumericalError where an RBF map's solution by iteration stands
///         still; ResourceLimit before allocating too much
[[nodiscard]] TextureResult mapTexture(const levelset::NarrowBand& base,
                                       const levelset::NarrowBand& texture, const Patch& patch,
                                       const TextureOptions& options = {});

/// The same texture on each of many patches of one base: all have one voxel size, overlaps are
/// united, and the base is merged once, so that a patch costs no more for being one of many.
/// @throws as above; UsageError when there is no patch; InvalidInput when all were to be skipped
[[nodiscard]] TextureResult mapTexture(const levelset::NarrowBand& base,
                                       const levelset::NarrowBand& texture,
                                       std::span<const Patch> patches,
                                       const TextureOptions& options = {});

}  // namespace mapping
