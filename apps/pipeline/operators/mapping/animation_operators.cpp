#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <utility>

#include "apps/pipeline/grammar/file_sequence.h"
#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/mapping/patch_quality_options.h"
#include "apps/pipeline/operators/mapping/texture_options.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/units.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/files/band_file.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/meshing/band_to_mesh.h"
#include "mapping/animation/animation.h"
#include "mapping/animation/frame_notes.h"
#include "mapping/placement/make_patch.h"

namespace pipeline {
namespace {

using levelset::NarrowBand;
using levelset::UsageError;
using mapping::Patch;

constexpr long kMostFrames = 100000;

std::size_t framesOf(const Invocation& in) {
  return static_cast<std::size_t>(in.integer("frames"));
}

std::size_t keyCount(const Invocation& in) {
  return in.operands.size() - 2;
}

// === Files

/// @param what  name of the content, for the message
/// @param isKnown  returns whether the format can hold the content
FileSequence sequenceOf(const Invocation& in, const char* option, const char* example,
                        bool isKnown) {
  FileSequence sequence(in.text(option));
  if (sequence.hasNumber() && isKnown) return sequence;
  throw UsageError(
      fmt::format("{}: '{}' is not a sequence of such files; write # for the number, as in {}",
                  in.where(option), sequence.pattern(), example));
}

FileSequence outSequence(const Invocation& in) {
  const std::string pattern = in.text("out");
  const bool isMesh = levelset::isMeshFormat(pattern);
  return sequenceOf(in, "out", mapsMesh(in) ? "frame_###.ply" : "frame_###.vdb",
                    isMesh || (levelset::isBandFormat(pattern) && !mapsMesh(in)));
}

FileSequence baseSequence(const Invocation& in) {
  return sequenceOf(in, "base-frames", "base_###.vdb",
                    levelset::isBandFormat(in.text("base-frames")));
}

FileSequence textureSequence(const Invocation& in) {
  const std::string pattern = in.text("texture-frames");
  return sequenceOf(
      in, "texture-frames", mapsMesh(in) ? "texture_###.ply" : "texture_###.vdb",
      mapsMesh(in) ? levelset::isMeshFormat(pattern) : levelset::isBandFormat(pattern));
}

/// Returns the file of a frame, whose number is 1 or more.
std::filesystem::path frameFile(const Invocation& in, const FileSequence& sequence,
                                const char* first, std::size_t frame) {
  return sequence.file(static_cast<std::size_t>(in.integer(first)) + frame - 1);
}

std::vector<std::string> outFiles(const Invocation& in) {
  std::vector<std::string> files;
  const FileSequence sequence = outSequence(in);
  for (std::size_t f = 0; f < framesOf(in); ++f) files.push_back(sequence.file(f).string());
  return files;
}

/// Checks that all files exist before anything is computed.
void requireFrames(const Invocation& in, const FileSequence& sequence, const char* first) {
  for (std::size_t f = 1; f < framesOf(in); ++f) {
    const std::filesystem::path file = frameFile(in, sequence, first, f);
    if (levelset::isMeshFormat(file)) {
      (void)levelset::meshFileInfo(file);
    } else {
      (void)levelset::bandFileInfo(file);
    }
  }
}

void requireApart(const Invocation& in, const char* sequence, const char* first) {
  if (!in.given(sequence)) return;
  std::set<std::filesystem::path> read;
  const FileSequence files(in.text(sequence));
  for (std::size_t f = 1; f < framesOf(in); ++f)
    read.insert(levelset::canonicalFile(frameFile(in, files, first, f)));
  for (const std::string& file : outFiles(in)) {
    const std::filesystem::path written = levelset::canonicalFile(file);
    if (written.empty() || !read.contains(written)) continue;
    throw UsageError(fmt::format("animate: --out would write over '{}' of --{}; use other names",
                                 file, sequence));
  }
}

// === Keys

/// Frames of the key patches: --key-frames, or evenly spread.
std::vector<std::size_t> keyFrames(const Invocation& in) {
  const std::size_t count = keyCount(in), frames = framesOf(in);
  std::vector<std::size_t> keys;
  if (in.given("key-frames")) {
    const std::string text = in.text("key-frames");
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(',', begin), text.size());
      const long frame = parseInteger(text.substr(begin, end - begin), in.where("key-frames"));
      if (frame < 0)
        throw UsageError(fmt::format("{}: there is no frame {}", in.where("key-frames"), frame));
      keys.push_back(static_cast<std::size_t>(frame));
      begin = end + 1;
    }
    if (keys.size() != count)
      throw UsageError(fmt::format("{}: {} frames for {} patches; give one for each, 0 first",
                                   in.where("key-frames"), keys.size(), count));
  } else {
    for (std::size_t k = 0; k < count; ++k)
      keys.push_back(count > 1 ? (2 * k * (frames - 1) + count - 1) / (2 * (count - 1)) : 0);
  }
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (keys[k] < frames && (k == 0 ? keys[k] == 0 : keys[k] > keys[k - 1])) continue;
    throw UsageError(fmt::format(
        "animate: {} patches do not fit {} frames: patch {} would stand at frame {}; the first "
        "stands at frame 0, each later than the one before, the last at {} at most",
        count, frames, k + 1, keys[k], frames - 1));
  }
  return keys;
}

void validateAnimate(const Invocation& in) {
  validateTextureOptions(in);
  if (in.integer("frames") > kMostFrames)
    throw UsageError(fmt::format("animate: --frames {} are too many; give at most {}",
                                 in.integer("frames"), kMostFrames));
  (void)outSequence(in);
  if (in.given("base-frames")) (void)baseSequence(in);
  if (in.given("texture-frames")) (void)textureSequence(in);
  for (const auto& [first, sequence] :
       {std::pair{"base-first", "base-frames"}, std::pair{"texture-first", "texture-frames"}}) {
    if (in.given(first) && !in.given(sequence))
      throw UsageError(fmt::format("animate: --{} goes with --{}", first, sequence));
    if (in.integer(first) < 0)
      throw UsageError(
          fmt::format("{}: no file has the number {}", in.where(first), in.integer(first)));
    requireApart(in, sequence, first);
  }
  if (in.number("drift") < 1)
    throw UsageError(fmt::format(
        "animate: --drift {} is below 1, a factor of nothing; give 1 or more", in.number("drift")));
  (void)keyFrames(in);
}

/// Frames between the keys follow the first patch. Rejects a key patch that another action or other
/// options made, and warns where its fineness differs or is unknown.
void requireLikeFirst(Invocation& in, std::size_t patch) {
  const PatchRecipe* first = in.operands[2].patch().recipe.get();
  const PatchRecipe* other = in.operands[1 + patch].patch().recipe.get();
  if (!first) return;  // reported when the patch is built again
  if (!other) {
    in.notes.warnings.push_back(fmt::format(
        "how patch {} was made is not in its file; the frames between are made as the first",
        patch));
    return;
  }
  if (first->action != other->action) {
    throw UsageError(fmt::format(
        "animate: patch {} was made by '{}' and the first by '{}'; the frames between follow the "
        "first, so make both by one action",
        patch, other->action, first->action));
  }
  for (const auto& [option, value] : first->shape) {
    if (other->shape.at(option) == value) continue;
    throw UsageError(fmt::format(
        "animate: patch {} has another --{} than the first; the frames between follow the first, "
        "so give both the same",
        patch, option));
  }
  for (const auto& [option, value] : first->fineness) {
    if (other->fineness.at(option) == value) continue;
    in.notes.warnings.push_back(
        fmt::format("patch {} has another --{} than the first, which the frames between follow",
                    patch, option));
  }
}

std::vector<mapping::AnimationKey> keysOf(Invocation& in, const Imath::Box3d& textureBox) {
  const std::vector<std::size_t> frames = keyFrames(in);
  for (std::size_t k = 1; k < frames.size(); ++k) requireLikeFirst(in, k + 1);
  std::vector<mapping::AnimationKey> keys;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const PatchValue& value = in.operands[2 + k].patch();
    const bool isMoved = in.given("base-frames") || frames.size() > 1;
    if (isMoved && value.recipe && !value.recipe->fixed.empty()) {
      throw UsageError(fmt::format("animate: patch {} cannot be moved, since {}; leave them out",
                                   k + 1, value.recipe->fixed));
    }
    mapping::AnimationKey key;
    key.frame = frames[k];
    key.patches = patchesAtHeight(in, value, textureBox);
    if (value.recipe && value.recipe->outlines) {
      key.outlines = value.recipe->outlines(key.patches);
    } else if (!value.recipe) {
      for (const Patch& patch : key.patches) key.outlines.push_back(mapping::outlineOf(patch));
    }
    keys.push_back(std::move(key));
  }
  return keys;
}

/// Recipe of patches that were read from a file.
mapping::PatchMaker makerLike(const std::vector<Patch>& patches) {
  std::vector<mapping::PatchOptions> options;
  for (const Patch& patch : patches) options.push_back(mapping::optionsLike(patch));
  return [options](const NarrowBand& base, std::span<const mapping::Footprint> footprints,
                   std::span<const mapping::Footprint>, const levelset::Progress& progress) {
    std::vector<Patch> made;
    for (std::size_t i = 0; i < footprints.size(); ++i) {
      levelset::report(progress, static_cast<double>(i) / static_cast<double>(footprints.size()));
      made.push_back(
          mapping::makePatch(base, footprints[i].corners, footprints[i].height, options[i]).patch);
    }
    return made;
  };
}

/// Reads a level set, and warns once about repairs.
/// @param told  frames with such a warning
NarrowBand readFrame(Invocation& in, std::size_t frame, const std::filesystem::path& file,
                     std::set<std::size_t>& told) {
  levelset::BandRepairs repairs;
  NarrowBand band = levelset::readBand(file, {.maxMemory = in.maxMemory, .repairs = &repairs});
  if (told.insert(frame).second)
    for (const std::string& sentence : sentencesOf(repairs, file))
      in.notes.warnings.push_back(fmt::format("frame {}: {}", frame, sentence));
  return band;
}

mapping::AnimationOptions animationOptions(Invocation& in,
                                           const std::vector<mapping::AnimationKey>& keys) {
  mapping::AnimationOptions options;
  options.frames = framesOf(in);
  options.carry =
      in.text("carry") == "rigid" ? mapping::CarryRule::Rigid : mapping::CarryRule::Corners;
  options.driftWarning = in.number("drift");
  options.progress = in.progress;
  const PatchValue& first = in.operands[2].patch();
  const bool isMoved = in.given("base-frames") || keys.size() > 1;
  if (!first.recipe) {
    options.make = makerLike(keys.front().patches);
    const Patch& patch = keys.front().patches.front();
    const bool isConforming =
        mapping::optionsLike(patch).scheme == mapping::LayerScheme::Conforming;
    if (isMoved)
      in.notes.notes.push_back(fmt::format(
          "how the first patch was made is not in its file; where it moves it is made again with "
          "{} layers, {:.4g} between {} particles",
          patch.layers.size(), patch.spacing, isConforming ? "conforming" : "reduced"));
  } else if (first.recipe->around) {
    options.make = [around = first.recipe->around, height = keys.front().patches.front().height](
                       const NarrowBand& base, std::span<const mapping::Footprint>,
                       std::span<const mapping::Footprint>, const levelset::Progress& progress) {
      return around(base, height, progress);
    };
  } else {
    options.make = first.recipe->make;
  }
  if (first.recipe && first.recipe->isRigid) {
    if (in.given("carry") && options.carry == mapping::CarryRule::Corners)
      throw UsageError(
          "animate: a decal is told by its centre and direction, so its corners cannot be carried "
          "by themselves; leave --carry out");
    options.carry = mapping::CarryRule::Rigid;
  }
  if (in.given("base-frames")) {
    options.bases = [sequence = baseSequence(in), &in,
                     told = std::make_shared<std::set<std::size_t>>()](std::size_t frame) {
      return readFrame(in, frame, frameFile(in, sequence, "base-first", frame), *told);
    };
  }
  return options;
}

// === Notes

void tellAnimation(Invocation& in, const mapping::AnimationReport& report) {
  nlohmann::ordered_json json;
  json["frames"] = report.frames.size();
  json["reused"] = report.reused;
  json["patches_made"] = report.patchesMade;
  json["frame"] = nlohmann::ordered_json::array();
  double farthest = 0;
  mapping::Drift worst;
  for (const mapping::FrameReport& frame : report.frames) {
    nlohmann::ordered_json entry;
    entry["farthest_way"] = frame.farthestMove;
    entry["drift"] = {frame.drift.least, frame.drift.most};
    entry["remade"] = frame.isRemade;
    entry["skipped"] = frame.skipped;
    if (frame.corners.size() == 1)
      for (const Imath::V3d& c : frame.corners.front()) entry["corners"].push_back({c.x, c.y, c.z});
    json["frame"].push_back(std::move(entry));
    farthest = std::max(farthest, frame.farthestMove);
    if (frame.drift.factor() > worst.factor()) worst = frame.drift;
  }
  in.notes.detailsJson = json.dump();
  in.notes.warnings.insert(in.notes.warnings.end(), report.warnings.begin(), report.warnings.end());
  in.notes.notes.insert(in.notes.notes.end(), report.notes.begin(), report.notes.end());
  in.notes.notes.push_back(fmt::format(
      "{} frames, {} of them as the one before and not computed again; patches made {} times, no "
      "corner went further than {:.4g} from frame to frame",
      report.frames.size(), report.reused, report.patchesMade, farthest));
  if (worst.factor() > 1.001)
    in.notes.notes.push_back(fmt::format(
        "sides and diagonals of what was carried are {:.4g} to {:.4g} times as long as at first, "
        "where they changed most",
        worst.least, worst.most));
}

/// Untangles and relaxes patches. Warnings name their frame; only the first frame adds notes.
std::vector<Patch> improvedAt(Invocation& in, const mapping::PatchFrame& frame,
                              const Imath::V3d& textureSize) {
  std::vector<std::string>&notes = in.notes.notes, &warnings = in.notes.warnings;
  const std::size_t firstNote = notes.size(), firstWarning = warnings.size();
  const levelset::Progress progress = std::exchange(in.progress, frame.progress);
  ImprovedPatches improved =
      improvedPatches(in, frame.base, frame.patches, in.length("embed"), textureSize);
  in.progress = progress;
  for (std::size_t i = firstWarning; i < warnings.size(); ++i) {
    const std::string own = "animate: ";
    if (warnings[i].starts_with(own)) warnings[i].erase(0, own.size());
    warnings[i] = fmt::format("frame {}: {}", frame.index, warnings[i]);
  }
  if (frame.index > 0) notes.resize(firstNote);
  return std::move(improved.patches);
}

/// Writes meshes frame by frame, and warns once about attributes that the format cannot hold.
class MeshWriter {
 public:
  explicit MeshWriter(Invocation& in) : in_(in), out_(outSequence(in)) {}
  void write(std::size_t frame, const levelset::TriMesh& mesh) {
    const std::filesystem::path file = out_.file(frame);
    levelset::writeMesh(file, mesh);
    if (isTold_ || mesh.attributes.isEmpty() || levelset::holdsAttributes(file)) return;
    isTold_ = true;
    in_.notes.warnings.push_back(fmt::format(
        "{} and the frames after hold positions and triangles only: the {} were left out; write "
        ".ply or .obj to keep them",
        file.string(), describe(mesh.attributes)));
  }

 private:
  Invocation& in_;
  FileSequence out_;
  bool isTold_ = false;
};

bool isSame(const levelset::TriMesh& a, const levelset::TriMesh& b) {
  const levelset::MeshAttributes &p = a.attributes, &q = b.attributes;
  return a.positions == b.positions && a.triangles == b.triangles && a.precision == b.precision &&
         a.spacing == b.spacing && p.normals == q.normals && p.uvs == q.uvs &&
         p.colors == q.colors && p.precision == q.precision &&
         p.colorPrecision == q.colorPrecision && p.hasAlpha == q.hasAlpha;
}

// === The action

Value animateMesh(Invocation& in, const std::vector<mapping::AnimationKey>& keys) {
  constexpr double kImproving = 0.3;  // share of the progress
  MeshWriter writer(in);
  mapping::MeshTextureOptions options = meshTextureOptions(in);
  options.textureBox = textureBoxOf(
      in);  // the box of frame 0 for all frames, so that growth of the texture is visible
  levelset::TriMesh texture = in.mesh(1);
  mapping::MeshTextureResult result;
  std::vector<Patch> patches;
  std::vector<std::size_t> skipped;
  std::vector<std::string> notes;
  mapping::FrameNotes frameNotes;
  std::size_t reused = 0;
  mapping::AnimationReport report = mapping::animatePatches(
      in.band(0), keys, animationOptions(in, keys), [&](const mapping::PatchFrame& frame) {
        bool isReused = frame.isUnchanged;
        if (frame.index > 0 && in.given("texture-frames")) {
          levelset::TriMesh next =
              levelset::readMesh(frameFile(in, textureSequence(in), "texture-first", frame.index),
                                 {.maxMemory = in.maxMemory});
          isReused = isReused && isSame(next, texture);
          texture = std::move(next);
        }
        if (isReused) {
          ++reused;
        } else {
          if (!frame.isUnchanged) {
            mapping::PatchFrame part = frame;
            part.progress = levelset::subProgress(frame.progress, 0, kImproving);
            patches = improvedAt(in, part, options.textureBox->size());
          }
          options.progress = levelset::subProgress(frame.progress, kImproving, 1);
          result = mapping::mapMesh(texture, patches, options);
          for (const std::string& note : result.notes) frameNotes.add(frame.index, note, notes);
        }
        skipped.push_back(result.skipped);
        writer.write(frame.index, result.mesh);
      });
  report.reused = reused;
  report.notes.insert(report.notes.end(), notes.begin(), notes.end());
  for (std::size_t f = 0; f < skipped.size(); ++f) report.frames[f].skipped = skipped[f];
  tellAnimation(in, report);
  return Value(std::move(result.mesh));
}

Value animate(Invocation& in) {
  if (in.given("base-frames")) requireFrames(in, baseSequence(in), "base-first");
  if (in.given("texture-frames")) requireFrames(in, textureSequence(in), "texture-first");
  const Imath::Box3d textureBox = textureBoxOf(in);
  const std::vector<mapping::AnimationKey> keys = keysOf(in, textureBox);
  if (mapsMesh(in)) return animateMesh(in, keys);

  mapping::TextureAnimationOptions options;
  options.animation = animationOptions(in, keys);
  options.texture = textureOptions(in);
  if (improvesPatches(in)) {
    options.improve = [&](const mapping::PatchFrame& frame) {
      return improvedAt(in, frame, textureBox.size());
    };
  }
  std::set<std::size_t> told;
  if (in.given("texture-frames")) {
    options.textures = [sequence = textureSequence(in), &in, &told](std::size_t frame) {
      return readFrame(in, frame, frameFile(in, sequence, "texture-first", frame), told);
    };
  }
  const FileSequence out = outSequence(in);
  MeshWriter writer(in);
  levelset::TriMesh mesh;  // mesh of the previous frame, where meshes are written
  NarrowBand last;
  tellAnimation(in,
                mapping::animateTexture(
                    in.band(0), in.band(1), keys, options,
                    [&](std::size_t frame, const mapping::TextureResult& result, bool isReused) {
                      const std::filesystem::path file = out.file(frame);
                      if (frame + 1 == framesOf(in)) last = result.band;
                      if (!levelset::isMeshFormat(file)) {
                        levelset::writeBand(file, result.band);
                        return;
                      }
                      if (!isReused) mesh = levelset::bandToMesh(result.band);
                      writer.write(frame, mesh);
                    }));
  return Value(std::move(last));
}

std::vector<Param> animateParams() {
  std::vector<Param> params = {
      {.name = "frames",
       .type = ParamType::Integer,
       .doc = "number of frames; the first is frame 0",
       .range = Range::Positive,
       .required = true},
      {.name = "out",
       .type = ParamType::Path,
       .doc = "files of the frames, .vdb or meshes; # in the name stands for the number "
              "(frame_###.vdb)",
       .required = true},
      {.name = "base-frames",
       .type = ParamType::Path,
       .doc = "bases of the frames after the first; # in the name stands for the number"},
      {.name = "base-first",
       .type = ParamType::Integer,
       .doc = "number of the file that is the base of frame 1",
       .fallback = "1"},
      {.name = "texture-frames",
       .type = ParamType::Path,
       .doc = "textures of the frames after the first, likewise; without --texture-box, the box of "
              "the first frame's texture holds for all"},
      {.name = "texture-first",
       .type = ParamType::Integer,
       .doc = "number of the file that is the texture of frame 1",
       .fallback = "1"},
      {.name = "key-frames",
       .type = ParamType::Text,
       .doc = "frames at which the patches are reached, as 0,12,30; default: evenly spread"},
      {.name = "carry",
       .type = ParamType::Choice,
       .doc = "move each corner by itself, or turn the patch as a rigid shape",
       .fallback = "corners",
       .choices = {"corners", "rigid"}},
      {.name = "drift",
       .type = ParamType::Number,
       .doc = "warn about carried patches that grow or shrink by more than this factor",
       .fallback = "1.5",
       .range = Range::Positive}};
  const std::vector<Param> texture = textureParams();
  params.insert(params.end(), texture.begin(), texture.end());
  return params;
}

}  // namespace

Operator animateOperator() {
  return {
      .name = "animate",
      .group = "Texture mapping",
      .summary = "animate a texture: on a moving base, from patch to patch, or by a moving texture",
      .details =
          "The operands are base, texture and patch, as for `texture`, and further patches as key "
          "frames. Base, texture and first patch belong to frame 0; each further patch lies on the "
          "base of its own frame. Between two key patches the first is carried forwards and the "
          "second backwards along the bases, and the frames interpolate evenly between them. "
          "Frames in between use the options of the first patch. Each frame is written when it is "
          "done; the result is the last frame. Unchanged parts are not computed again.",
      .example =
          "levelsmith sphere --radius 10 --voxel 0.8 --as ball ! torus --radius 4 --tube 1.5 "
          "--voxel 0.8 --as ring ! patch @ball --at 0,0,10 --size 8,8 --height 3 --layers 2 "
          "--as here ! patch @ball --at 10,0,0 --size 6,6 --rotate -90 --height 2 --layers 2 "
          "--as there ! animate @ball @ring @here @there --frames 3 --voxel 0.8 --out "
          "ring_##.vdb ! measure",
      .params = animateParams(),
      .operands = {{Kind::Band}, {Kind::Band, Kind::Mesh}, {Kind::Patch}},
      .takesMore = true,
      .resultKind = [](const Invocation& in) { return mapsMesh(in) ? Kind::Mesh : Kind::Band; },
      .run = animate,
      .plan = planTexture,
      .validate = validateAnimate,
      .targets = outFiles,
  };
}

}  // namespace pipeline
