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

/// Geometric textures that move [Brodersen07 §10]: the texture, the base and the patch may each
/// change from frame to frame. Frames count from 0.
namespace mapping {

/// Makes patches anew on a base.
/// @param footprints  where they shall stand
/// @param origins     the same at frame 0, on the base of frame 0
/// @return as many, and in the order, as there were before
using PatchMaker = std::function<std::vector<Patch>(
    const levelset::NarrowBand& base, std::span<const Footprint> footprints,
    std::span<const Footprint> origins, const levelset::Progress& progress)>;

/// Remakes a patch of which nothing is known but its particles, with as many of them: along ∇φ
/// where all layers have equal counts, on a relaxed net of its own on each layer otherwise.
[[nodiscard]] PatchOptions optionsLike(const Patch& patch);

/// Patches as they stand at one frame, on the base of that frame.
struct AnimationKey {
  std::vector<Patch> patches;
  /// What is carried and moved; often one to each patch, one to a grid of them.
  std::vector<PatchOutline> outlines;
  std::size_t frame = 0;
};

/// A level set for each frame but the first, which the caller holds. May read files; frames may be
/// asked for more than once, and one is held at a time.
using BandFrames = std::function<levelset::NarrowBand(std::size_t frame)>;

struct AnimationOptions {
  std::size_t frames = 2;  ///< how many
  CarryRule carry = CarryRule::Corners;
  BandFrames bases = {};  ///< empty: the base stands still
  PatchMaker make = {};   ///< as the patches of the first key were made
  /// A patch that is carried, whose sides or diagonals have grown or shrunk by more than this
  /// factor against its own key, is warned of.
  double driftWarning = 1.5;
  levelset::Progress progress = {};
};

/// What became of the patches at one frame.
struct FrameReport {
  std::size_t frame = 0;
  std::vector<std::array<Imath::V3d, 4>> corners;  ///< of each outline
  double farthestWay = 0;   ///< of any corner since the frame before, world units
  Drift drift = {};         ///< of the worst outline, since its key or until the next
  bool isRemade = false;    ///< the patches had to be made again
  std::size_t skipped = 0;  ///< patches left out because they fold, see TextureOptions::skipFolds
};

/// One frame, for whoever maps onto it. References end with the call.
struct PatchFrame {
  std::size_t index = 0;
  const levelset::NarrowBand& base;
  const std::vector<Patch>& patches;
  bool isUnchanged = false;  ///< base and patches are to the bit those of the frame before
  levelset::Progress progress = {};
};

struct AnimationReport {
  std::vector<FrameReport> frames;
  std::size_t patchesMade = 0;  ///< frames whose patches had to be made
  std::size_t reused = 0;       ///< frames that were the same as the one before, texture included
  /// What any frame says ("frame 3: …"), told of the first to say it.
  std::vector<std::string> warnings, notes;
};

/// Carries and moves patches from frame to frame, and calls `visit` for each.
///
/// Between two keys the patches of the first are carried forwards along the bases, those of the
/// second backwards, and at frame f the patches stand (f − f₀) / (f₁ − f₀) of the way from one to
/// the other on the base of f, see PatchPath. At the frame of a key its patches are used as they
/// are. After the last key they are carried on. Where nothing changes nothing is made again.
/// @param base  of frame 0
/// @param keys  at least one, the first at frame 0, in the order of their frames; all of as many
///              patches, mirrored alike
/// @throws UsageError for keys out of order or that do not go together; InvalidInput where a patch
///         does not lie on its base, a corner has no surface, corners come to lie on different
///         parts of it, or a patch turns over; and whatever `options` and `visit` throw. All but
///         UsageError and Cancelled tell the frame
[[nodiscard]] AnimationReport animatePatches(const levelset::NarrowBand& base,
                                             const std::vector<AnimationKey>& keys,
                                             const AnimationOptions& options,
                                             const std::function<void(const PatchFrame&)>& visit);

struct TextureAnimationOptions {
  AnimationOptions animation = {};
  /// But for its progress. Where textures change and no box is given, that of frame 0 holds for
  /// all: what leaves it goes on beyond the patch, but in a shell is cut off, with a warning.
  TextureOptions texture = {};
  BandFrames textures = {};  ///< empty: the texture stays
  /// Made of the patches before they are mapped onto, once where these stay; empty: nothing.
  std::function<std::vector<Patch>(const PatchFrame& frame)> improve = {};
};

/// @param isReused  base, texture and patches are those of the frame before, and so is the result
using FrameWriter =
    std::function<void(std::size_t frame, const TextureResult& result, bool isReused)>;

/// The same with a texture mapped onto the patches of each frame.
/// @param texture  of frame 0
/// @param write    is given each frame as soon as it is made
/// @throws as animatePatches and mapTexture do
[[nodiscard]] AnimationReport animateTexture(const levelset::NarrowBand& base,
                                             const levelset::NarrowBand& texture,
                                             const std::vector<AnimationKey>& keys,
                                             const TextureAnimationOptions& options,
                                             const FrameWriter& write);

}  // namespace mapping
