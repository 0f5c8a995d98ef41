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
/// @param footprints  positions of the new patches
/// @param origins     the footprints at frame 0, on the base of frame 0
/// @return the same number of patches in the same order
using PatchMaker = std::function<std::vector<Patch>(
    const levelset::NarrowBand& base, std::span<const Footprint> footprints,
    std::span<const Footprint> origins, const levelset::Progress& progress)>;

/// Options that rebuild a patch of unknown origin with as many particles as it has. If all layers
/// have equal counts, particles follow ∇φ. Otherwise each layer is a separate relaxed net.
[[nodiscard]] PatchOptions optionsLike(const Patch& patch);

/// Patches at one frame, on the base of that frame.
struct AnimationKey {
  std::vector<Patch> patches;
  /// Outlines that are carried and moved; usually one for each patch, or one for a grid of patches.
  std::vector<PatchOutline> outlines;
  std::size_t frame = 0;
};

/// Returns a level set for each frame except the first, which the caller holds. It may read files.
/// The same frame may be requested more than once, and one frame is held at a time.
using BandFrames = std::function<levelset::NarrowBand(std::size_t frame)>;

struct AnimationOptions {
  std::size_t frames = 2;  ///< number of frames
  CarryRule carry = CarryRule::Corners;
  BandFrames bases = {};  ///< empty: the base does not change
  PatchMaker make = {};   ///< builds patches like those of the first key
  /// Factor for the drift warning. It is issued when the sides or diagonals of a carried patch have
  /// changed by more than this factor since its key.
  double driftWarning = 1.5;
  levelset::Progress progress = {};
};

/// Changes of the patches at one frame.
struct FrameReport {
  std::size_t frame = 0;
  std::vector<std::array<Imath::V3d, 4>> corners;  ///< corners of each outline
  /// Largest displacement of a corner since the previous frame, world units.
  double farthestMove = 0;
  Drift drift = {};         ///< of the worst outline, relative to the previous or next key
  bool isRemade = false;    ///< true: the patches had to be rebuilt
  std::size_t skipped = 0;  ///< patches left out because they fold, see TextureOptions::skipFolds
};

/// Data of one frame for the caller's visitor. References are valid during the call.
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
  std::size_t patchesMade = 0;  ///< number of frames whose patches had to be rebuilt
  std::size_t reused = 0;       ///< number of frames equal to the previous one, texture included
  /// Messages of all frames ("frame 3: …"), each reported for its first frame.
  std::vector<std::string> warnings, notes;
};

/// Carries and moves patches from frame to frame, and calls `visit` for each frame.
///
/// Between two keys the patches of the first are carried forwards along the bases, and those of the
/// second backwards. At frame f the patches are interpolated between the two by (f − f₀) / (f₁ −
/// f₀) on the base of f, see PatchPath. At the frame of a key its patches are used unchanged. After
/// the last key its patches are carried on. If nothing changes, nothing is rebuilt.
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
  /// Options of the texture; its progress is ignored. If textures change and no box is given, the
  /// box of frame 0 is used for all. An RBF map continues the texture outside that box; a prism map
  /// cuts it off, with a warning.
  TextureOptions texture = {};
  BandFrames textures = {};  ///< empty: the texture does not change
  /// Changes the patches before the texture is mapped, once if they do not change; empty: no
  /// change.
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
