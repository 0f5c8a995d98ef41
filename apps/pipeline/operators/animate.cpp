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

#include "apps/pipeline/file_row.h"
#include "apps/pipeline/invocation.h"
#include "apps/pipeline/operators/shell.h"
#include "apps/pipeline/operators/texture_options.h"
#include "apps/pipeline/units.h"
#include "levelset/error.h"
#include "levelset/files/band_file.h"
#include "levelset/files/mesh_file.h"
#include "levelset/meshing/band_to_mesh.h"
#include "mapping/animation/animation.h"

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

/// @param what  of their content
/// @param isKnown  is the format one that holds it?
FileRow rowOf(const Invocation& in, const char* option, const char* example, bool isKnown) {
  FileRow row(in.text(option));
  if (row.hasNumber() && isKnown) return row;
  throw UsageError(
      fmt::format("{}: '{}' names no row of such files; put # where the number goes, as in {}",
                  in.where(option), row.pattern(), example));
}

FileRow outRow(const Invocation& in) {
  const std::string pattern = in.text("out");
  const bool isMesh = levelset::isMeshFormat(pattern);
  return rowOf(in, "out", mapsMesh(in) ? "frame_###.ply" : "frame_###.vdb",
               isMesh || (levelset::isBandFormat(pattern) && !mapsMesh(in)));
}

FileRow baseRow(const Invocation& in) {
  return rowOf(in, "base-frames", "base_###.vdb", levelset::isBandFormat(in.text("base-frames")));
}

FileRow textureRow(const Invocation& in) {
  const std::string pattern = in.text("texture-frames");
  return rowOf(in, "texture-frames", mapsMesh(in) ? "texture_###.ply" : "texture_###.vdb",
               mapsMesh(in) ? levelset::isMeshFormat(pattern) : levelset::isBandFormat(pattern));
}

/// The file of a frame, 1 or more.
std::filesystem::path frameFile(const Invocation& in, const FileRow& row, const char* first,
                                std::size_t frame) {
  return row.file(static_cast<std::size_t>(in.integer(first)) + frame - 1);
}

std::vector<std::string> outFiles(const Invocation& in) {
  std::vector<std::string> files;
  const FileRow row = outRow(in);
  for (std::size_t f = 0; f < framesOf(in); ++f) files.push_back(row.file(f).string());
  return files;
}

/// Refuses what is missing before anything is computed.
void requireFrames(const Invocation& in, const FileRow& row, const char* first) {
  for (std::size_t f = 1; f < framesOf(in); ++f) {
    const std::filesystem::path file = frameFile(in, row, first, f);
    if (levelset::isMeshFormat(file)) {
      (void)levelset::meshFileInfo(file);
    } else {
      (void)levelset::bandFileInfo(file);
    }
  }
}

void requireApart(const Invocation& in, const char* row, const char* first) {
  if (!in.given(row)) return;
  std::set<std::filesystem::path> read;
  const FileRow files(in.text(row));
  for (std::size_t f = 1; f < framesOf(in); ++f)
    read.insert(std::filesystem::absolute(frameFile(in, files, first, f)).lexically_normal());
  for (const std::string& file : outFiles(in)) {
    if (!read.contains(std::filesystem::absolute(file).lexically_normal())) continue;
    throw UsageError(
        fmt::format("animate: --out would write over '{}' of --{}; use other names", file, row));
  }
}

// === Keys

/// When the patches stand as they are: --key-frames, or evenly spread.
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
  (void)outRow(in);
  if (in.given("base-frames")) (void)baseRow(in);
  if (in.given("texture-frames")) (void)textureRow(in);
  for (const auto& [first, row] :
       {std::pair{"base-first", "base-frames"}, std::pair{"texture-first", "texture-frames"}}) {
    if (in.given(first) && !in.given(row))
      throw UsageError(fmt::format("animate: --{} goes with --{}", first, row));
    if (in.integer(first) < 0)
      throw UsageError(
          fmt::format("{}: no file has the number {}", in.where(first), in.integer(first)));
    requireApart(in, row, first);
  }
  if (in.number("drift") < 1)
    throw UsageError(fmt::format(
        "animate: --drift {} is below 1, a factor of nothing; give 1 or more", in.number("drift")));
  (void)keyFrames(in);
}

std::vector<mapping::AnimationKey> keysOf(Invocation& in, const Imath::Box3d& textureBox) {
  const std::vector<std::size_t> frames = keyFrames(in);
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

/// Of patches that were read from a file.
mapping::PatchMaker makerLike(const std::vector<Patch>& patches) {
  std::vector<mapping::PatchOptions> options;
  for (const Patch& patch : patches) options.push_back(mapping::optionsLike(patch));
  return [options](const NarrowBand& base, std::span<const mapping::Footprint> footprints,
                   std::span<const mapping::Footprint>, const levelset::Progress& progress) {
    std::vector<Patch> made;
    for (std::size_t i = 0; i < footprints.size(); ++i) {
      levelset::report(progress, static_cast<double>(i) / static_cast<double>(footprints.size()),
                       "animate");
      made.push_back(
          mapping::makePatch(base, footprints[i].corners, footprints[i].height, options[i]).patch);
    }
    return made;
  };
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
        mapping::optionsLike(patch).scheme == mapping::LevelScheme::Conforming;
    if (isMoved)
      in.notes.notes.push_back(fmt::format(
          "how the first patch was made is not in its file; where it moves it is made again with "
          "{} levels, {:.4g} between {} particles",
          patch.levels.size(), patch.spacing, isConforming ? "conforming" : "reduced"));
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
    options.bases = [row = baseRow(in), &in](std::size_t frame) {
      return levelset::readBand(frameFile(in, row, "base-first", frame),
                                {.maxMemory = in.maxMemory});
    };
  }
  return options;
}

// === What is told

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
    entry["farthest_way"] = frame.farthestWay;
    entry["drift"] = {frame.drift.least, frame.drift.most};
    entry["remade"] = frame.isRemade;
    if (frame.corners.size() == 1)
      for (const Imath::V3d& c : frame.corners.front()) entry["corners"].push_back({c.x, c.y, c.z});
    json["frame"].push_back(std::move(entry));
    farthest = std::max(farthest, frame.farthestWay);
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

/// Patches as --unfold and --relax leave them; what these say is told of the first frame only.
std::vector<Patch> improvedAt(Invocation& in, const NarrowBand& base, std::vector<Patch> patches,
                              const Imath::V3d& textureSize, bool& isTold) {
  const std::size_t notes = in.notes.notes.size(), warnings = in.notes.warnings.size();
  const levelset::Progress progress = std::exchange(in.progress, {});
  ImprovedPatches improved =
      improvedPatches(in, base, std::move(patches), in.length("sink"), textureSize);
  in.progress = progress;
  if (isTold) {
    in.notes.notes.resize(notes);
    in.notes.warnings.resize(warnings);
  }
  isTold = isTold || in.notes.warnings.size() > warnings || in.notes.notes.size() > notes;
  return std::move(improved.patches);
}

// === The action

Value animateMesh(Invocation& in, const std::vector<mapping::AnimationKey>& keys) {
  const FileRow out = outRow(in);
  const Imath::V3d size = textureBoxOf(in).size();
  levelset::TriMesh texture = in.mesh(1), result;
  std::size_t reused = 0;
  bool isTold = false;
  mapping::AnimationReport report = mapping::animatePatches(
      in.band(0), keys, animationOptions(in, keys), [&](const mapping::PatchFrame& frame) {
        bool isSame = frame.isUnchanged;
        if (frame.index > 0 && in.given("texture-frames")) {
          levelset::TriMesh next =
              levelset::readMesh(frameFile(in, textureRow(in), "texture-first", frame.index),
                                 {.maxMemory = in.maxMemory});
          isSame =
              isSame && next.positions == texture.positions && next.triangles == texture.triangles;
          texture = std::move(next);
        }
        if (isSame) {
          ++reused;
        } else {
          mapping::MeshTextureOptions options = meshTextureOptions(in);
          options.progress = frame.progress;
          const std::vector<Patch> patches =
              improvedAt(in, frame.base, frame.patches, size, isTold);
          result = mapping::mapMesh(texture, patches, options).mesh;
        }
        levelset::writeMesh(out.file(frame.index), result);
      });
  report.reused = reused;
  tellAnimation(in, report);
  return Value(std::move(result));
}

Value animate(Invocation& in) {
  if (in.given("base-frames")) requireFrames(in, baseRow(in), "base-first");
  if (in.given("texture-frames")) requireFrames(in, textureRow(in), "texture-first");
  const Imath::Box3d textureBox = textureBoxOf(in);
  const std::vector<mapping::AnimationKey> keys = keysOf(in, textureBox);
  if (mapsMesh(in)) return animateMesh(in, keys);

  const FileRow out = outRow(in);
  bool isTold = false;
  mapping::TextureAnimationOptions options;
  options.animation = animationOptions(in, keys);
  options.texture = textureOptions(in);
  options.improve = [&](const NarrowBand& base, std::vector<Patch> patches) {
    return improvedAt(in, base, std::move(patches), textureBox.size(), isTold);
  };
  if (in.given("texture-frames")) {
    options.textures = [row = textureRow(in), &in](std::size_t frame) {
      return levelset::readBand(frameFile(in, row, "texture-first", frame),
                                {.maxMemory = in.maxMemory});
    };
  }
  NarrowBand last;
  tellAnimation(in, mapping::animateTexture(
                        in.band(0), in.band(1), keys, options,
                        [&](std::size_t frame, const mapping::TextureResult& result, bool) {
                          const std::filesystem::path file = out.file(frame);
                          if (frame + 1 == framesOf(in)) last = result.band;
                          if (levelset::isMeshFormat(file)) {
                            levelset::writeMesh(file, levelset::bandToMesh(result.band));
                          } else {
                            levelset::writeBand(file, result.band);
                          }
                        }));
  return Value(std::move(last));
}

std::vector<Param> animateParams() {
  std::vector<Param> params = {
      {.name = "frames",
       .type = ParamType::Integer,
       .doc = "how many, the first is frame 0",
       .range = Range::Positive,
       .required = true},
      {.name = "out",
       .type = ParamType::Path,
       .doc = "where the frames go, as .vdb or as meshes; # in the name is the number "
              "(frame_###.vdb)",
       .required = true},
      {.name = "base-frames",
       .type = ParamType::Path,
       .doc = "bases of the frames after the first, # in the name is the number"},
      {.name = "base-first",
       .type = ParamType::Integer,
       .doc = "number of the file that is the base of frame 1",
       .fallback = "1"},
      {.name = "texture-frames",
       .type = ParamType::Path,
       .doc = "textures of the frames after the first, likewise"},
      {.name = "texture-first",
       .type = ParamType::Integer,
       .doc = "number of the file that is the texture of frame 1",
       .fallback = "1"},
      {.name = "key-frames",
       .type = ParamType::Text,
       .doc = "0,12,30: when the patches stand as they are; default: evenly spread"},
      {.name = "carry",
       .type = ParamType::Choice,
       .doc = "corners by themselves, or the whole patch, which keeps its shape and turns",
       .fallback = "corners",
       .choices = {"corners", "rigid"}},
      {.name = "drift",
       .type = ParamType::Number,
       .doc = "warn of carried patches that have grown or shrunk by more than this factor",
       .fallback = "1.5",
       .range = Range::Positive}};
  const std::vector<Param> texture = textureParams();
  params.insert(params.end(), texture.begin(), texture.end());
  return params;
}

}  // namespace

void addAnimationOperators(std::vector<Operator>& all) {
  all.push_back({
      .name = "animate",
      .group = "Texture mapping",
      .summary = "a texture that moves: on a moving base, from patch to patch, or by itself",
      .details =
          "The operands are base, texture and patch, as of `texture`, and further patches to go "
          "to. All are those of frame 0, but for the further patches, each of which stands on the "
          "base of its own frame. Between two patches the first is carried forwards and the second "
          "backwards along the bases, and the way between them is gone evenly. Each frame is "
          "written when it is done; the result is the last. What does not change is not computed "
          "again.",
      .example =
          "levelsmith sphere --radius 10 --voxel 0.8 --as ball ! torus --radius 4 --tube 1.5 "
          "--voxel 0.8 --as ring ! patch @ball --at 0,0,10 --size 8,8 --height 3 --levels 2 "
          "--as here ! patch @ball --at 10,0,0 --size 6,6 --rotate -90 --height 2 --levels 2 "
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
