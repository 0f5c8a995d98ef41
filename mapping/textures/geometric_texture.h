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

/// Maps a solid onto patches of a surface as a level set [Brodersen07 §8.3, §8.5].
namespace mapping {

enum class TextureMerge {
  Union,  ///< adds the texture to the base
  Carve,  ///< subtracts the texture from the base
  Alone   ///< returns only the warped texture
};

enum class TextureMap {
  /// Radial basis functions (RbfMap): smooth, defined everywhere, relaxed by λ.
  Rbf,
  /// PrismMap: piecewise linear in tetrahedra between the particles of the patch, which must be
  /// dense.
  Prism
};

struct TextureOptions {
  TextureMerge merge = TextureMerge::Union;
  TextureMap map = TextureMap::Rbf;
  /// Depth of the texture below the surface, world units; empty: one voxel of the base.
  std::optional<double> embedDepth = {};
  /// Radius of the blend along the seam of texture and base, world units; 0: no blend.
  double blend = 0;
  /// Box that is mapped to the unit cube of u, v, w; empty: the box of the texture's zero set. An
  /// RBF map also maps parts of the texture outside the box, to positions beyond the patch. A prism
  /// map cuts off these parts.
  std::optional<Imath::Box3d> textureBox = {};
  /// Voxel size of the result, world units. Empty: the smaller of the base's voxel size and the
  /// texture's voxel size times the smallest stretch of the maps.
  std::optional<double> voxelSize = {};
  double halfWidth = 3;        ///< half width of the result's band, voxels
  RbfMapOptions rbf = {};      ///< solveTolerance is ignored: a tenth of mapTolerance is used
  double mapTolerance = 0.05;  ///< error bound of the map's fast evaluation, texture voxels
  bool allowFolds = false;
  /// Leave out patches whose map folds or that pass through themselves; an error if no patch is
  /// left.
  bool skipFolds = false;
  std::size_t maxMemory = levelset::kNoMemoryLimit;
  levelset::Progress progress = {};
};

/// CPU time of the steps of mapTexture(), seconds summed over all threads.
struct TextureCost {
  double setup = 0;  ///< solving for the map, or building its tetrahedra
  /// Measuring the distortion, and certifying that the map does not fold.
  double certificate = 0;
  /// Evaluating the texture at the grid points of the result.
  double mapping = 0;
  double distance = 0;  ///< restoring distances in the mapped textures
  /// Merging the mapped textures with each other and with the base.
  double merging = 0;
};

/// Measurements over all patches. Distortion and certificate are those of the worst patch.
struct TextureReport {
  double voxelSize = 0;
  /// Mapped patches, and patches left out because they fold or pass through themselves.
  std::size_t patches = 0, skipped = 0;
  std::size_t particles = 0, blocksTested = 0, blocksEvaluated = 0;
  /// Particles summed or tetrahedra tested, per grid point of the evaluated blocks.
  double operationsPerPoint = 0;
  Distortion distortion = {};
  FoldCertificate certificate = {};
  /// Largest |Φ(p) − uvw| × texture size over all particles p with texture coordinates uvw, for the
  /// map Φ; world units.
  double mapResidual = 0;
  /// Largest error of the map's fast evaluation at random grid points, texture voxels.
  double mapError = 0;
  std::size_t mapErrorPoints = 0;
  /// Solver reports of all maps combined: worst values, and sums of merged particles; RBF maps
  /// only.
  RbfSolveReport solve = {};
  TextureCost cost = {};
  std::vector<std::string> notes;
};

struct TextureResult {
  levelset::NarrowBand band;
  TextureReport report;
};

/// Default voxel size of a result, world units: the texture's voxel size times the stretch if that
/// is smaller than the base's voxel size, otherwise the base's voxel size.
/// @param base, texture  voxel sizes of the base and the texture, world units
/// @param minStretch  smallest stretch of the map from the texture to the patches
[[nodiscard]] double resultVoxelSize(double base, double texture, double minStretch);

/// Builds the RBF map of a patch from its particles and rims to their texture coordinates. A rim
/// consists of the particles just outside a layer, see ParticleLayer. λ is lambdaNear for the
/// particles at w = 0. The rims reduce the error beside the patch's sides. For an embedded texture
/// the columns continue linearly beyond the first or last layer.
/// @param embedDepth  depth of the texture below the surface, in w; negative: its lift above the
///         last layer
[[nodiscard]] RbfMap patchToTexture(const Patch& patch, const RbfMapOptions& options = {},
                                    double embedDepth = 0);

/// An RBF map with its samples and its fold certificate.
struct CertifiedRbf {
  std::unique_ptr<RbfMap> map;
  std::vector<MapSample> samples;
  FoldCertificate certificate;
  bool isExtrapolated = false;
};

/// Builds and certifies the RBF map of a patch for an embedded texture. Particles that continue the
/// columns to the embedded part of the texture may make the map fold, as below a crease. If the map
/// folds with these particles and not without them, the map without them is returned, and
/// isExtrapolated is true.
/// @param cost  the times for setup and certificate are added to it
[[nodiscard]] CertifiedRbf certifiedRbf(const Patch& patch, double embedDepth,
                                        const RbfMapOptions& options, TextureCost& cost);

/// Checks that the patch lies on the surface of the base.
/// @throws InvalidInput, with the position, if it does not
void requirePatchOn(const levelset::NarrowBand& base, const Patch& patch);

/// Warps `texture` into the patch, restores distances [Brodersen07 §8.3], and merges the result
/// with `base`. If the warped texture needs no finer voxels than those of the base, the result has
/// the grid of the base.
/// @param base     the solid on which the patch was built
/// @param texture  any solid; x, y, z of its box become u, v, w
/// @throws UsageError for lengths that are negative or not finite
/// @throws InvalidInput if the map folds (with the position), the patch does not lie on `base`, or
///         the texture box is empty
/// @throws NumericalError if the iterative solver of an RBF map stagnates
/// @throws ResourceLimit if the memory estimate exceeds `maxMemory`
[[nodiscard]] TextureResult mapTexture(const levelset::NarrowBand& base,
                                       const levelset::NarrowBand& texture, const Patch& patch,
                                       const TextureOptions& options = {});

/// Maps the same texture onto each of many patches of one base. All mapped textures have one voxel
/// size. Their overlaps are united, and the base is merged once, so that the cost per patch does
/// not grow with the number of patches.
/// @throws UsageError as above, and if there is no patch
/// @throws InvalidInput as above, and if all patches were skipped
/// @throws NumericalError, ResourceLimit as above
[[nodiscard]] TextureResult mapTexture(const levelset::NarrowBand& base,
                                       const levelset::NarrowBand& texture,
                                       std::span<const Patch> patches,
                                       const TextureOptions& options = {});

}  // namespace mapping
