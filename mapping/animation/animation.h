#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "levelset/narrow_band.h"
#include "levelset/progress.h"
#include "mapping/animation/footprint.h"
#include "mapping/patches/patch.h"
#include "mapping/textures/geometric_texture.h"

/// Animated geometric textures [Brodersen07 §10]: the texture, the base and the patches may each
/// change from frame to frame. Frames count from 0.
namespace mapping {

/// Rebuilds patches on a base.
/// @param footprints  positions to which the patches move: one for each patch, or one for a grid of
///         patches
/// @param origins     the footprints at frame 0, on the base of frame 0
/// @return as many patches as the first key frame has, in the same order
using PatchMaker = std::function<std::vector<Patch>(
    const levelset::NarrowBand& base, std::span<const Footprint> footprints,
    std::span<const Footprint> origins, const levelset::Progress& progress)>;

/// Options that rebuild a patch with about as many particles as it has, for a patch whose own
/// options are unknown. A patch of LayerScheme::Reduced, whose layers are relaxed one by one, keeps
/// its scheme. Any other patch gets LayerScheme::Conforming: particles follow ∇φ. If `patch.scheme`
/// is empty, a patch counts as Reduced if its layers have different numbers of particles.
[[nodiscard]] PatchOptions optionsLike(const Patch& patch);

/// Key frame: patches at one frame, on the base of that frame.
struct AnimationKey {
  std::vector<Patch> patches;
  /// Outlines of the patches, which follow the base between the key frames; one for each patch, or
  /// one for a grid of patches.
  std::vector<PatchOutline> outlines;
  std::size_t frame = 0;
};

/// Returns the level set of a frame, for example from a file. The level set of frame 0 is passed
/// separately and never requested. A frame may be requested more than once. Only one returned level
/// set is kept at a time.
using BandFrames = std::function<levelset::NarrowBand(std::size_t frame)>;

struct AnimationOptions {
  std::size_t frames = 2;  ///< number of frames
  CarryRule carry = CarryRule::Corners;
  BandFrames bases = {};  ///< bases of the frames from 1 on; empty: the base does not change
  PatchMaker make = {};   ///< rebuilds patches like those of the first key at new positions
  /// Factor for the drift warning. It is issued when a side or diagonal of a carried patch has
  /// become longer or shorter than at its key frame by more than this factor.
  double driftWarning = 1.5;
  levelset::Progress progress = {};
};

/// Report on the patches at one frame.
struct FrameReport {
  std::size_t frame = 0;
  std::vector<std::array<Imath::V3d, 4>> corners;  ///< corners of each moved outline
  /// Largest displacement of a corner since the previous frame, world units.
  double farthestMove = 0;
  /// Largest drift of an outline, relative to its shape at the previous or at the next key.
  Drift drift = {};
  bool isRemade = false;    ///< true: the patches were rebuilt
  std::size_t skipped = 0;  ///< patches left out because they fold, see TextureOptions::skipFolds
};

/// Base and patches of one frame, passed to `visit` of animatePatches(). References are valid
/// during the call.
struct PatchFrame {
  std::size_t index = 0;
  const levelset::NarrowBand& base;
  const std::vector<Patch>& patches;
  /// True: base and patches equal those of the previous frame, bit for bit.
  bool isUnchanged = false;
  levelset::Progress progress = {};
};

struct AnimationReport {
  std::vector<FrameReport> frames;
  std::size_t patchesMade = 0;  ///< number of frames whose patches were rebuilt
  std::size_t reused = 0;       ///< number of frames whose base, patches and texture did not change
  /// Messages of all frames ("frame 3: …"); a message that repeats is reported for its first frame
  /// only.
  std::vector<std::string> warnings, notes;
};

/// Carries and moves patches from frame to frame, and calls `visit` for each frame.
///
/// Between two keys at the frames f₀ and f₁, the outlines of the first key are carried forwards
/// along the bases, and the outlines of the second key backwards. At frame f the outlines are
/// interpolated between both by (f − f₀) / (f₁ − f₀) on the base of f, see PatchPath, and the
/// patches are rebuilt there. At the frame of a key its patches are used unchanged. After the last
/// key its outlines are carried forwards. If nothing changes, nothing is rebuilt.
/// @param base  base of frame 0
/// @param keys  at least one, the first at frame 0, ordered by frame; all with the same number of
///         patches, mirrored alike
/// @throws UsageError for keys that are out of order or do not match each other
/// @throws InvalidInput if a patch does not lie on its base, a corner has no surface, corners end
///         on different surface components, or a patch is inverted
/// @throws any exception of `options` and `visit`. All exceptions except UsageError and Cancelled
///         give the frame.
[[nodiscard]] AnimationReport animatePatches(const levelset::NarrowBand& base,
                                             const std::vector<AnimationKey>& keys,
                                             const AnimationOptions& options,
                                             const std::function<void(const PatchFrame&)>& visit);

struct TextureAnimationOptions {
  AnimationOptions animation = {};
  /// Options of the texture; the member `progress` is ignored. If the texture changes and no box is
  /// given, all frames use the texture's box at frame 0. An RBF map continues the texture outside
  /// that box; a prism map cuts it off, with a warning.
  TextureOptions texture = {};
  BandFrames textures = {};  ///< textures from frame 1 on; empty: the texture does not change
  /// Changes the patches of a frame before the texture is mapped. It is called only for frames
  /// whose base or patches differ from those of the previous frame. Empty: no change.
  std::function<std::vector<Patch>(const PatchFrame& frame)> improve = {};
};

/// Receives the result of a frame.
/// @param isReused  true if base, texture and patches, and so the result, equal those of the
///         previous frame
using FrameWriter =
    std::function<void(std::size_t frame, const TextureResult& result, bool isReused)>;

/// Runs animatePatches and maps a texture onto the patches of each frame.
/// @param texture  texture of frame 0
/// @param write    called for each frame as soon as it is computed
/// @throws as animatePatches and mapTexture
[[nodiscard]] AnimationReport animateTexture(const levelset::NarrowBand& base,
                                             const levelset::NarrowBand& texture,
                                             const std::vector<AnimationKey>& keys,
                                             const TextureAnimationOptions& options,
                                             const FrameWriter& write);

}  // namespace mapping
