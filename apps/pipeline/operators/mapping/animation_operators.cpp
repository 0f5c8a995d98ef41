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
#include "apps/pipeline/operators/mapping/deform_animation.h"
#include "apps/pipeline/operators/mapping/key_frames.h"
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

std::size_t keyCount(const Invocation& in) {
  return in.operands.size() - 2;
}

// === Files

/// Returns the file sequence that an option names.
/// @param example  pattern of a valid sequence, for the error message
/// @param isKnown  true if the format of the files can store the frames
FileSequence sequenceOf(const Invocation& in, const char* option, const char* example,
                        bool isKnown) {
  FileSequence sequence(in.text(option));
  if (sequence.hasNumber() && isKnown) return sequence;
  throw UsageError(fmt::format(
      "{}: '{}' is not a sequence of files of a suitable format; write # for the number, as in {}",
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

/// Returns the file that is read for a frame.
/// @param first  name of the option that gives the number in the file name of frame 1
/// @param frame  number of the frame, 1 or more
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

/// Checks that the files of all frames after frame 0 exist, before anything is computed. Frame 0
/// uses the operands.
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

std::vector<std::size_t> keyFrames(const Invocation& in) {
  return keyFrames(in, keyCount(in), "patch", "patches");
}

void validateAnimate(const Invocation& in) {
  validateTextureOptions(in);
  (void)framesOf(in);
  (void)outSequence(in);
  if (in.given("base-frames")) (void)baseSequence(in);
  if (in.given("texture-frames")) (void)textureSequence(in);
  for (const auto& [first, sequence] :
       {std::pair{"base-first", "base-frames"}, std::pair{"texture-first", "texture-frames"}}) {
    if (in.given(first) && !in.given(sequence))
      throw UsageError(fmt::format("animate: --{} needs --{}; give both", first, sequence));
    if (in.integer(first) < 0)
      throw UsageError(fmt::format("{}: the file number {} is negative; give 0 or more",
                                   in.where(first), in.integer(first)));
    requireApart(in, sequence, first);
  }
  if (in.number("drift") < 1)
    throw UsageError(fmt::format(
        "animate: --drift {} is below 1, but it is a factor of growth or shrinkage; give 1 or more",
        in.number("drift")));
  (void)keyFrames(in);
}

/// Checks that a key patch was built like the first one, whose recipe builds the patches between
/// the keys. Rejects a key patch of another action or with other options of its shape. Warns if its
/// resolution differs, or if its recipe is unknown.
/// @param patch  number of the key patch; the first has number 1
void requireLikeFirst(Invocation& in, std::size_t patch) {
  const PatchRecipe* first = in.operands[2].patch().recipe.get();
  const PatchRecipe* other = in.operands[1 + patch].patch().recipe.get();
  if (!first) return;  // reported when the patch is built again
  if (!other) {
    in.notes.warnings.push_back(
        fmt::format("the file of patch {} does not record how the patch was built; the patches "
                    "between key frames are built like the first patch",
                    patch));
    return;
  }
  if (first->action != other->action) {
    throw UsageError(
        fmt::format("animate: patch {} was built by '{}' and the first patch by '{}'; the patches "
                    "between key frames are built like the first, so build both by the same action",
                    patch, other->action, first->action));
  }
  for (const auto& [option, value] : first->shape) {
    if (other->shape.at(option) == value) continue;
    throw UsageError(
        fmt::format("animate: patch {} and the first patch differ in --{}; the patches between key "
                    "frames are built like the first, so give both the same value",
                    patch, option));
  }
  for (const auto& [option, value] : first->fineness) {
    if (other->fineness.at(option) == value) continue;
    in.notes.warnings.push_back(
        fmt::format("patch {} and the first patch differ in --{}; the patches between key frames "
                    "are built like the first",
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
      throw UsageError(
          fmt::format("animate: patch {} cannot be moved, since {}; leave this option out", k + 1,
                      value.recipe->fixed));
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

/// Returns a function that rebuilds patches from a file, whose recipe is unknown.
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

/// Reads the level set of a frame. Warns about repairs once for each frame, although a frame may be
/// read several times.
/// @param told  frames about whose repairs a warning was already given
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
          "the file of the first patch does not record how the patch was built; in frames where it "
          "moves it is rebuilt with {} layers and a spacing of {:.4g} between {} particles",
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
          "animate: a decal is defined by its centre and direction, so its corners cannot move "
          "separately; leave --carry out");
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
      "{} frames, of which {} equal the previous frame and were not computed again; patches were "
      "built in {} frames; a corner moves by at most {:.4g} from frame to frame",
      report.frames.size(), report.reused, report.patchesMade, farthest));
  if (worst.factor() > 1.001)
    in.notes.notes.push_back(
        fmt::format("the sides and diagonals of the patch that changes most are {:.4g} to {:.4g} "
                    "times as long as at its key frame",
                    worst.least, worst.most));
}

/// Untangles and relaxes the patches of a frame. Warnings name the frame; only frame 0 adds notes.
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
    in_.notes.warnings.push_back(
        fmt::format("{} and the files of later frames store positions and triangles only: the {} "
                    "were left out; write .ply or .obj to keep them",
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
  constexpr double kImproving = 0.3;  // share of untangling and relaxing in the progress of a frame
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
  levelset::TriMesh
      mesh;  // mesh of the previous frame; empty when the frames are written as level sets
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
       .doc = "files of the frames to write, .vdb or meshes, and pictures of moved control points; "
              "# in the name stands for the number "
              "of the frame, as in frame_###.vdb",
       .required = true},
      {.name = "base-frames",
       .type = ParamType::Path,
       .doc = "files with the bases of frames 1, 2, …; # in the name stands for the number of the "
              "file, as in base_###.vdb"},
      {.name = "base-first",
       .type = ParamType::Integer,
       .doc = "number in the name of the --base-frames file for frame 1",
       .fallback = "1"},
      {.name = "texture-frames",
       .type = ParamType::Path,
       .doc = "files with the textures of frames 1, 2, …; # in the name stands for the number of "
              "the file; without --texture-box, all frames use the box of the texture of frame 0"},
      {.name = "texture-first",
       .type = ParamType::Integer,
       .doc = "number in the name of the --texture-frames file for frame 1",
       .fallback = "1"},
      {.name = "key-frames",
       .type = ParamType::Text,
       .doc = "frame of each patch operand, lattice or Bézier volume, as 0,12,30; default: evenly "
              "distributed over all frames"},
      {.name = "carry",
       .type = ParamType::Choice,
       .doc = "motion of a patch with the base: corners, each corner goes to the nearest point of "
              "the new surface; rigid, the patch moves and turns without a change of its shape",
       .fallback = "corners",
       .choices = {"corners", "rigid"}},
      {.name = "drift",
       .type = ParamType::Number,
       .doc = "warn when sides or diagonals of a moved patch have grown or shrunk by more than "
              "this factor since its key frame",
       .fallback = "1.5",
       .range = Range::Positive}};
  const std::vector<Param> texture = textureParams();
  params.insert(params.end(), texture.begin(), texture.end());
  return params;
}

}  // namespace

Operator animateOperator() {
  return withControlPoints({
      .name = "animate",
      .group = "Texture mapping",
      .summary = "animate a texture on a moving base, from patch to patch, or a moving texture; or "
                 "move a solid, mesh, point cloud or Bézier volume by key-framed control points",
      .details =
          "The operands are base, texture and patch, as for `texture`, and further patches as key "
          "frames. Base, texture and first patch belong to frame 0; each further patch lies on the "
          "base of its own frame. Between two key patches the first is carried forwards and the "
          "second backwards along the bases, and the frames interpolate evenly between them. "
          "Frames in between use the options of the first patch. Each frame is written when it is "
          "done; the result is the last frame. Unchanged parts are not computed again. With "
          "--lattices, the only operand is deformed by lattices, whose control points are "
          "interpolated between key frames. All frames are certified before the first one is "
          "written; a fold is an error that names the frame. A fold between frames is a warning. "
          "With --cages and --cage, cages move the operand. Each of their frames is certified "
          "before it is written. With --beziers, the only operand is a "
          "scene, and the control points of its Bézier volume are interpolated. Then --out may "
          "also name pictures, as frame_###.png.",
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
  });
}

}  // namespace pipeline
