#include "mapping/animation/animation.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

#include "levelset/error.h"
#include "mapping/animation/frame_notes.h"
#include "mapping/animation/patch_path.h"
#include "mapping/layers/patch_layers.h"
#include "mapping/textures/texture_placement.h"

namespace mapping {
namespace {

using Imath::V3d;
using levelset::InvalidInput;
using levelset::NarrowBand;
using levelset::UsageError;

using Footprints = std::vector<Footprint>;

/// Runs `call` and adds the frame to its errors, except to usage errors, which concern all frames,
/// and to errors that name a frame already.
template <typename Call>
auto atFrame(std::size_t frame, const Call& call) {
  try {
    return call();
  } catch (const UsageError&) {
    throw;
  } catch (const levelset::Cancelled&) {
    throw;
  } catch (const levelset::Error& error) {
    const std::string sentence = error.what();
    if (sentence.starts_with("frame ")) throw;
    levelset::rethrow(error, fmt::format("frame {}: {}", frame, sentence));
  }
}

bool isSameLayer(const ParticleLayer& a, const ParticleLayer& b) {
  return a.columns == b.columns && a.rows == b.rows && a.w == b.w && a.height == b.height &&
         a.positions == b.positions && a.rim == b.rim;
}

bool isSamePatch(const Patch& a, const Patch& b) {
  return a.corners == b.corners && a.height == b.height && a.mirrored == b.mirrored &&
         std::equal(a.layers.begin(), a.layers.end(), b.layers.begin(), b.layers.end(),
                    isSameLayer);
}

void checkKeys(const std::vector<AnimationKey>& keys, const AnimationOptions& options) {
  if (options.frames < 1) throw UsageError("the number of frames is 0; give at least 1");
  if (keys.empty() || keys.front().frame != 0)
    throw UsageError("no patch is at frame 0; give the first patch the frame 0");
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (keys[k].patches.empty())
      throw UsageError(fmt::format("patch {} is an empty set; leave it out", k + 1));
    if (keys[k].frame >= options.frames || (k > 0 && keys[k].frame <= keys[k - 1].frame)) {
      throw UsageError(fmt::format(
          "patch {} is at frame {}, which is not between the frame of the previous patch and "
          "the last frame, {}; give increasing frames, or more frames",
          k + 1, keys[k].frame, options.frames - 1));
    }
    if (keys.size() == 1) continue;
    if (keys[k].outlines.empty()) {
      throw UsageError(fmt::format(
          "patch {} goes all around its axis and cannot be moved to another position; leave "
          "out the other patches",
          k + 1));
    }
    if (keys[k].outlines.size() != keys.front().outlines.size()) {
      throw UsageError(
          fmt::format("patch {} has {} outlines and the first patch {}; give sets of patches of "
                      "the same size",
                      k + 1, keys[k].outlines.size(), keys.front().outlines.size()));
    }
    const std::vector<Patch>&first = keys.front().patches, &patches = keys[k].patches;
    if (patches.size() != first.size()) {
      throw UsageError(fmt::format(
          "patch {} is a set of {} tiles, the first patch a set of {}; the frames between them "
          "follow the first patch, so give the same number of tiles for all",
          k + 1, patches.size(), first.size()));
    }
    for (std::size_t i = 0; i < patches.size(); ++i) {
      if (patches[i].mirrored == first[i].mirrored) continue;
      throw UsageError(
          fmt::format("either patch {} or the first patch is mirrored, but not both{}; mirror "
                      "both or neither",
                      k + 1, i > 0 ? fmt::format(", in member {}", i + 1) : ""));
    }
  }
}

/// Provides the bases of all frames. Only one base is in memory besides that of frame 0.
class Bases {
 public:
  Bases(const NarrowBand& first, const BandFrames& frames)
      : first_(first),
        frames_(frames),
        now_(first),
        hash_(first.contentHash()),
        firstHash_(hash_) {}

  const NarrowBand& at(std::size_t frame) {
    if (frame == frame_) return now_;
    if (!frames_) return now_;
    now_ = NarrowBand();  // frees memory before the next base is read
    now_ = frame == 0 ? first_ : frames_(frame);
    hash_ = frame == 0 ? firstHash_ : now_.contentHash();
    frame_ = frame;
    return now_;
  }
  [[nodiscard]] bool areMoving() const { return static_cast<bool>(frames_); }
  [[nodiscard]] bool mustRead(std::size_t frame) const { return frames_ && frame != frame_; }
  /// Content hash of the base that at() returned last.
  [[nodiscard]] std::uint64_t hash() const { return hash_; }

 private:
  const NarrowBand& first_;
  const BandFrames& frames_;
  NarrowBand now_;
  std::uint64_t hash_, firstHash_;
  std::size_t frame_ = 0;
};

class Animation {
 public:
  Animation(const NarrowBand& base, const std::vector<AnimationKey>& keys,
            const AnimationOptions& options, const std::function<void(const PatchFrame&)>& visit)
      : keys_(keys), options_(options), visit_(visit), bases_(base, options.bases) {}

  AnimationReport run() {
    for (std::size_t k = 1; k < keys_.size(); ++k) {
      warnOfLayers(k);
      // Checks that the patches lie on the base. If the base moves, footprintsOf() checks them on
      // the base of the key's frame.
      if (!bases_.areMoving()) atFrame(keys_[k].frame, [&] { requireOn(bases_.at(0), k); });
    }
    for (std::size_t k = 0; k < keys_.size(); ++k) {
      key_ = k;
      const std::size_t begin = keys_[k].frame;
      const std::size_t end = k + 1 < keys_.size() ? keys_[k + 1].frame : options_.frames;
      paths_.clear();
      if (k + 1 < keys_.size()) carryBackwards(begin, end);
      for (std::size_t f = begin; f < end; ++f) atFrame(f, [&] { playFrame(f, begin, end); });
    }
    return std::move(report_);
  }

 private:
  void warnOfLayers(std::size_t k) {
    const std::size_t layers = keys_[k].patches.front().layers.size(),
                      first = keys_.front().patches.front().layers.size();
    if (layers == first) return;
    report_.warnings.push_back(
        fmt::format("patch {} has {} layers and the first patch {}; the frames between them "
                    "follow the first patch, so give the same --layers for all",
                    k + 1, layers, first));
  }

  void requireOn(const NarrowBand& base, std::size_t key) const {
    for (const Patch& patch : keys_[key].patches) requirePatchOn(base, patch);
  }

  /// Base of a frame. The paths release the previous base before another one is read.
  const NarrowBand& baseAt(std::size_t frame) {
    if (bases_.mustRead(frame))
      for (PatchPath& path : paths_) path.dropBase();
    return bases_.at(frame);
  }

  [[nodiscard]] Footprints footprintsOf(const NarrowBand& base, std::size_t key) const {
    requireOn(base, key);
    Footprints all;
    for (const PatchOutline& outline : keys_[key].outlines) {
      levelset::report(options_.progress, done_);
      Footprint one = footprintOf(base, outline);
      if (options_.carry == CarryRule::Rigid || keys_.size() > 1)
        one = withReach(base, std::move(one), outline.direction.has_value());
      if (options_.carry == CarryRule::Rigid && !one.reach) {
        throw InvalidInput(fmt::format(
            "no geodesic leads from the centre {} of the patch to each of its corners; use "
            "--carry corners, or a smaller patch",
            pointAsOption(one.centre)));
      }
      all.push_back(std::move(one));
    }
    return all;
  }

  [[nodiscard]] Footprints carryAll(const NarrowBand& base, const Footprints& from) const {
    Footprints moved;
    for (const Footprint& one : from) {
      levelset::report(options_.progress, done_);
      moved.push_back(carryFootprint(base, one, options_.carry));
      // A footprint that stops moving must keep the same bits, so that its frames count as
      // unchanged.
      if (farthestMove(one, moved.back()) <= 1e-6 * base.voxelSize()) moved.back() = one;
    }
    return moved;
  }

  /// Carries the footprints of the next key backwards, from base to base, to the frames after
  /// `begin`.
  void carryBackwards(std::size_t begin, std::size_t end) {
    done_ = static_cast<double>(begin) / static_cast<double>(options_.frames);
    later_.assign(end - begin, {});
    goal_ = atFrame(end, [&] { return footprintsOf(bases_.at(end), key_ + 1); });
    Footprints now = goal_;
    std::uint64_t hash = bases_.hash();
    for (std::size_t f = end - 1; f > begin; --f) {
      levelset::report(options_.progress, done_);
      const Footprints before = now;
      atFrame(f, [&] {
        const NarrowBand& base = bases_.at(f);
        if (bases_.hash() != hash) now = carryAll(base, now);
      });
      hash = bases_.hash();
      warnOfDrift(f, before, now, goal_);
      later_[f - begin] = now;
    }
  }

  void playFrame(std::size_t f, std::size_t begin, std::size_t end) {
    done_ = static_cast<double>(f) / static_cast<double>(options_.frames);
    const double next = static_cast<double>(f + 1) / static_cast<double>(options_.frames);
    levelset::report(options_.progress, done_);
    const bool isFirst = report_.frames.empty();
    const NarrowBand& base = baseAt(f);
    const bool isSameBase = !isFirst && bases_.hash() == baseHash_;
    baseHash_ = bases_.hash();
    FrameReport report;
    report.frame = f;
    const bool isBetween = key_ + 1 < keys_.size();
    bool isUnchanged = isSameBase;
    const Footprints shownBefore = shown_;

    // === Footprints of this frame
    if (f == begin) {
      own_ = footprintsOf(base, key_);
      first_ = own_;
      if (f == 0) origins_ = own_;
      shown_ = own_;
      const std::vector<Patch>& given = keys_[key_].patches;
      const bool isSame =
          std::equal(given.begin(), given.end(), patches_.begin(), patches_.end(), isSamePatch);
      isUnchanged = isUnchanged && isSame;
      if (!isSame) patches_ = given;
      // If no path leads to the next key, fail before any frame is computed.
      if (!bases_.areMoving() && isBetween && begin + 1 < end)
        (void)atFrame(f + 1, [&] { return footprintsBetween(f + 1, begin, end); });
    } else {
      if (!isSameBase) {
        const Footprints before = own_;
        own_ = carryAll(base, own_);
        warnOfDrift(f, before, own_, first_);
      }
      shown_ = isBetween ? footprintsBetween(f, begin, end) : own_;
      isUnchanged = isUnchanged && shown_ == shownBefore;
      if (!isUnchanged) {
        patches_ = remade(
            base, levelset::subProgress(options_.progress, done_, done_ + 0.2 * (next - done_)));
        report.isRemade = true;
        ++report_.patchesMade;
      }
    }
    report.drift = worstDrift(first_, own_);
    if (isBetween && f > begin) {
      const Drift later = worstDrift(goal_, later_[f - begin]);
      if (later.factor() > report.drift.factor()) report.drift = later;
    }
    for (std::size_t i = 0; i < shown_.size(); ++i) {
      report.corners.push_back(shown_[i].corners);
      if (i < shownBefore.size())
        report.farthestMove =
            std::max(report.farthestMove, farthestMove(shownBefore[i], shown_[i]));
    }
    report_.frames.push_back(std::move(report));
    visit_(
        {.index = f,
         .base = base,
         .patches = patches_,
         .isUnchanged = isUnchanged,
         .progress = levelset::subProgress(options_.progress, done_ + 0.2 * (next - done_), next)});
    if (isUnchanged) ++report_.reused;
  }

  [[nodiscard]] Footprints footprintsBetween(std::size_t f, std::size_t begin, std::size_t end) {
    const NarrowBand& base = baseAt(f);
    const double part = static_cast<double>(f - begin) / static_cast<double>(end - begin);
    const bool areNew = paths_.size() != own_.size();
    if (areNew || pathHash_ != bases_.hash()) {
      std::vector<PatchPath> paths;
      for (std::size_t i = 0; i < own_.size(); ++i) {
        levelset::report(options_.progress, done_);
        Footprint from = own_[i], to = later_[f - begin][i];
        if (!from.reach) from = withReach(base, std::move(from));
        if (!to.reach) to = withReach(base, std::move(to));
        paths.emplace_back(base, std::move(from), std::move(to), options_.carry,
                           areNew ? std::vector<V3d>{} : paths_[i].centrePath());
        warnOfPath(f, paths.back(), areNew);
      }
      paths_ = std::move(paths);
      pathHash_ = bases_.hash();
    }
    Footprints result;
    for (PatchPath& path : paths_) {
      path.setBase(base);
      result.push_back(path.at(part));
    }
    return result;
  }

  /// Warns about a path. Each warning is issued once between two keys, for all patches and frames.
  void warnOfPath(std::size_t f, const PatchPath& path, bool isNew) {
    if (!path.isAlike()) {
      warnOnce(warnedOfPaths_,
               fmt::format(
                   "frame {}: the paths of the corners cannot follow that of the patch's "
                   "centre; each corner takes its own shortest path, and where these lead around "
                   "different sides the patch is stretched; use --carry rigid, or add a patch "
                   "between the two",
                   f));
    }
    // Largest turn without a warning, radians. Halfway along the path, the sides are shorter by the
    // factor cos(turn / 2).
    constexpr double kMostTurn = 1;
    if (isNew && options_.carry == CarryRule::Corners && std::abs(path.turn()) > kMostTurn) {
      warnOnce(
          warnedOfTurn_,
          fmt::format("frame {}: the patch turns by {:.0f} degrees on its path, and shrinks "
                      "in between because its corners move along geodesics; --carry rigid turns "
                      "it without shrinking",
                      f, std::abs(path.turn()) * 180 / std::acos(-1.0)));
    }
    if (path.hasJumped()) {
      warnOnce(
          warnedOfJump_,
          fmt::format("frame {}: the path from patch to patch differs from that of the previous "
                      "frame, and may lead around another side of the object; add a patch between "
                      "the two to fix the side",
                      f));
    }
  }

  /// Adds a warning once for each key.
  /// @param key  last key with this warning, counted from 1; 0: none
  void warnOnce(std::size_t& key, std::string warning) {
    if (key == key_ + 1) return;
    key = key_ + 1;
    report_.warnings.push_back(std::move(warning));
  }

  [[nodiscard]] std::vector<Patch> remade(const NarrowBand& base,
                                          const levelset::Progress& progress) const {
    if (!options_.make)
      throw UsageError(
          "the patches move, but no function rebuilds them; set AnimationOptions::make");
    std::vector<Patch> patches;
    try {
      patches = options_.make(base, shown_, origins_, progress);
    } catch (const UsageError& error) {  // the options were valid for the patch before it moved
      throw InvalidInput(error.what());
    }
    const std::vector<Patch>& first = keys_.front().patches;
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const Patch& patch = patches[i];
      if (patch.mirrored == first[std::min(i, first.size() - 1)].mirrored) continue;
      throw InvalidInput(fmt::format(
          "the patch is inverted: its corners {}, {}, {} and {} are now in the opposite order; "
          "use --carry rigid, or end the animation before this frame",
          pointAsOption(patch.corners[0]), pointAsOption(patch.corners[1]),
          pointAsOption(patch.corners[2]), pointAsOption(patch.corners[3])));
    }
    return patches;
  }

  [[nodiscard]] static Drift worstDrift(const Footprints& first, const Footprints& now) {
    Drift worst;
    for (std::size_t i = 0; i < now.size(); ++i) {
      const Drift drift = driftBetween(first[i], now[i]);
      if (drift.factor() > worst.factor()) worst = drift;
    }
    return worst;
  }

  /// Warns about outlines that are stretched since their key or moved far since the previous frame.
  /// Each warning is issued once for each key.
  void warnOfDrift(std::size_t f, const Footprints& before, const Footprints& now,
                   const Footprints& first) {
    const Drift drift = worstDrift(first, now);
    if (drift.factor() > options_.driftWarning) {
      warnOnce(warnedOfDrift_,
               fmt::format("frame {}: sides or diagonals of the patch are {:.3g} to {:.3g} "
                           "times as long as at its key; {}",
                           f, drift.least, drift.most,
                           options_.carry == CarryRule::Corners
                               ? "use --carry rigid to keep its shape"
                               : "the cause is the bending of the surface under it"));
    }
    for (std::size_t i = 0; i < now.size(); ++i) {
      const double move = farthestMove(before[i], now[i]);
      const double size = (before[i].corners[2] - before[i].corners[0]).length();
      if (!(move > 0.5 * size)) continue;
      warnOnce(
          warnedOfMove_,
          fmt::format(
              "frame {}: a corner moved by {:.4g} to the nearest point of the surface, over half "
              "of the patch's diagonal; give frames in between, or check that it is still on the "
              "same surface component",
              f, move));
    }
  }

  const std::vector<AnimationKey>& keys_;
  const AnimationOptions& options_;
  const std::function<void(const PatchFrame&)>& visit_;
  Bases bases_;
  AnimationReport report_;
  std::size_t key_ = 0;
  std::size_t warnedOfDrift_ = 0, warnedOfMove_ = 0, warnedOfPaths_ = 0, warnedOfTurn_ = 0,
              warnedOfJump_ = 0;  ///< last key for which each warning was issued, from 1; 0: none
  double done_ = 0;
  std::uint64_t baseHash_ = 0, pathHash_ = 0;
  Footprints origins_;  ///< footprints at frame 0
  /// own_: footprints of the last key, carried to the base of the current frame. first_: the same
  /// footprints on the base of the key's frame. shown_: footprints of the current frame,
  /// interpolated between own_ and those of the next key.
  Footprints own_, first_, shown_;
  Footprints goal_;  ///< footprints of the next key
  /// [frame − frame of the last key]: footprints of the next key, carried back to the base of that
  /// frame.
  std::vector<Footprints> later_;
  std::vector<PatchPath> paths_;
  std::vector<Patch> patches_;
};

}  // namespace

PatchOptions optionsLike(const Patch& patch) {
  const ParticleLayer& surface = patch.layers.front();
  const bool areAlike =
      std::all_of(patch.layers.begin(), patch.layers.end(), [&](const ParticleLayer& layer) {
        return layer.columns == surface.columns && layer.rows == surface.rows;
      });
  // Without a stored scheme, unequal particle counts of the layers show that they were relaxed.
  const bool isTravelling = patch.scheme ? *patch.scheme != LayerScheme::Reduced : areAlike;
  PatchOptions options{.layers = std::max<std::size_t>(2, patch.layers.size()),
                       .scheme = isTravelling ? LayerScheme::Conforming : LayerScheme::Reduced,
                       .spacing = patch.spacing,
                       .mirror = true};
  if (areAlike && surface.columns > 3 && surface.rows > 3)
    options.cells = {surface.columns - 1, surface.rows - 1};
  return options;
}

AnimationReport animatePatches(const NarrowBand& base, const std::vector<AnimationKey>& keys,
                               const AnimationOptions& options,
                               const std::function<void(const PatchFrame&)>& visit) {
  checkKeys(keys, options);
  return Animation(base, keys, options, visit).run();
}

AnimationReport animateTexture(const NarrowBand& base, const NarrowBand& texture,
                               const std::vector<AnimationKey>& keys,
                               const TextureAnimationOptions& options, const FrameWriter& write) {
  constexpr double kImproving = 0.3;  // share of a frame's progress for options.improve
  std::optional<TextureResult> result;
  std::vector<Patch> improved;
  std::vector<std::size_t> skipped;
  std::vector<std::string> notes, warnings;
  FrameNotes frameNotes, frameWarnings;
  std::uint64_t textureHash = 0;
  std::size_t reused = 0;
  double finest = HUGE_VAL, coarsest = 0;
  TextureOptions mapping = options.texture;
  // The texture's box at frame 0 is used for all frames, so that a growing texture also grows in
  // the result.
  const bool keepsBox = options.textures && !mapping.textureBox;
  if (keepsBox) mapping.textureBox = texture.zeroSetBounds();
  AnimationReport report = animatePatches(base, keys, options.animation, [&](const PatchFrame& f) {
    const NarrowBand now = f.index == 0 || !options.textures ? texture : options.textures(f.index);
    const std::uint64_t hash = !options.textures && f.index > 0 ? textureHash : now.contentHash();
    const bool isReused = result && f.isUnchanged && hash == textureHash;
    textureHash = hash;
    if (isReused) {
      ++reused;
    } else {
      result.reset();  // frees memory before the next result is computed
      const bool improves = options.improve && !f.isUnchanged;
      if (improves) {
        PatchFrame part = f;
        part.progress = levelset::subProgress(f.progress, 0, kImproving);
        improved = options.improve(part);
      }
      mapping.progress = levelset::subProgress(f.progress, improves ? kImproving : 0, 1);
      result = mapTexture(f.base, now, options.improve ? improved : f.patches, mapping);
      finest = std::min(finest, result->report.voxelSize);
      coarsest = std::max(coarsest, result->report.voxelSize);
      for (const std::string& note : result->report.notes) frameNotes.add(f.index, note, notes);
      if (keepsBox && mapping.map == TextureMap::Prism &&
          isBeyond(now.zeroSetBounds(), *mapping.textureBox, now.voxelSize()))
        frameWarnings.add(
            f.index,
            "the texture extends beyond the box of frame 0 and is cut off there, where "
            "the prism map ends; give --texture-box, or use --map rbf",
            warnings);
    }
    skipped.push_back(result->report.skipped);
    write(f.index, *result, isReused);
  });
  report.reused = reused;
  for (std::size_t f = 0; f < skipped.size(); ++f) report.frames[f].skipped = skipped[f];
  std::move(notes.begin(), notes.end(), std::back_inserter(report.notes));
  std::move(warnings.begin(), warnings.end(), std::back_inserter(report.warnings));
  if (coarsest > finest)
    report.notes.push_back(
        fmt::format("voxel sizes vary from {:.4g} to {:.4g} because the texture is compressed "
                    "differently in each frame; give --voxel to use one size for all frames",
                    finest, coarsest));
  return report;
}

}  // namespace mapping
