#include "apps/pipeline/operators/mapping/deform_animation.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/grammar/file_sequence.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/mapping/key_frames.h"
#include "apps/pipeline/operators/pictures/camera_options.h"
#include "apps/pipeline/operators/solids/deform_action.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/deform/keys/lattice_keys.h"
#include "levelset/deform/lattice_certificate.h"
#include "levelset/deform/lattice_file.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/meshing/band_to_mesh.h"
#include "render/bezier/bezier_keys.h"
#include "render/images/image.h"
#include "render/views/bezier_file.h"

namespace pipeline {
namespace {

using levelset::ControlLattice;
using levelset::KeyWeight;
using levelset::UsageError;
using render::BezierVolume;

/// Name of a key in which nothing is moved.
constexpr const char* kRest = "rest";
/// Options of `render` for frames that are pictures, beside those of the camera.
const std::set<std::string> kPictureOptions = {"style", "samples", "renderer"};
/// Options that move operands by control points and that `animate` has for textures too.
const std::set<std::string> kCommonOptions = {"frames", "out", "key-frames", "voxel", "half-width"};

std::set<std::string> cameraOptions() {
  std::vector<Param> params;
  addCameraParams(params);
  std::set<std::string> names;
  for (const Param& param : params) names.insert(param.name);
  return names;
}

const char* keyOption(const Invocation& in) {
  return in.given("lattices") ? "lattices" : "beziers";
}

bool isAlone(const Invocation& in) {
  return in.given("lattices") || in.given("beziers");
}

bool isPictureOption(const std::string& name) {
  static const std::set<std::string> camera = cameraOptions();
  return camera.contains(name) || kPictureOptions.contains(name);
}

std::vector<std::string> keyNames(const Invocation& in) {
  std::istringstream stream(in.text(keyOption(in)));
  std::vector<std::string> names;
  for (std::string name; stream >> name;) names.push_back(name);
  return names;
}

std::vector<std::size_t> framesOfKeys(const Invocation& in) {
  return in.given("lattices")
             ? keyFrames(in, keyNames(in).size(), "lattice", "lattices")
             : keyFrames(in, keyNames(in).size(), "Bézier volume", "Bézier volumes");
}

bool writesPictures(const Invocation& in) {
  return !render::imageFormat(in.text("out"), "").empty();
}

bool writesMeshOfBand(const Invocation& in) {
  return in.operands[0].kind() == Kind::Band && levelset::isMeshFormat(in.text("out"));
}

/// The action that writes a frame: `write`, or `render` with the options for pictures.
Invocation writerOf(const Invocation& in, const std::string& file) {
  std::map<std::string, std::string> options = {{"file", file}};
  for (const Param& param : in.op().params)
    if (writesPictures(in) && isPictureOption(param.name) && in.given(param.name))
      options.emplace(param.name, in.text(param.name));
  return {*findOperator(writesPictures(in) ? "render" : "write"), std::move(options)};
}

std::vector<std::string> frameFiles(const Invocation& in) {
  const FileSequence sequence(in.text("out"));
  std::vector<std::string> files;
  for (std::size_t f = 0; f < framesOf(in); ++f) files.push_back(sequence.file(f).string());
  return files;
}

// === Checks

void requireOwnOptions(const Invocation& in) {
  const bool movesLattices = in.given("lattices");
  if (movesLattices && in.given("beziers"))
    throw UsageError("animate: --lattices and --beziers exclude each other; give one of them");
  for (const Param& param : in.op().params) {
    if (!in.given(param.name)) continue;
    const bool isForPictures = isPictureOption(param.name);
    if (isForPictures && !writesPictures(in))
      throw UsageError(fmt::format(
          "animate: --{} is for pictures, but --out names no .png or .exr; leave it out",
          param.name));
    const bool isOwn = isForPictures || kCommonOptions.contains(param.name) ||
                       param.name == keyOption(in) || param.name == "interpolation";
    if (!isOwn)
      throw UsageError(
          fmt::format("animate: --{} is for textures, but --{} moves control points; leave it out",
                      param.name, keyOption(in)));
  }
  for (const char* name : {"voxel", "half-width"})
    if (in.given(name) && (!movesLattices || in.operands[0].kind() != Kind::Band))
      throw UsageError(fmt::format("animate: --{} is for level sets; leave it out", name));
}

/// Refuses options of control points beside a texture.
void requireTextureOptions(const Invocation& in) {
  if (in.operands.empty() || in.operands[0].kind() == Kind::Band) {
    for (const Param& param : in.op().params)
      if (in.given(param.name) && (isPictureOption(param.name) || param.name == "interpolation"))
        throw UsageError(
            fmt::format("animate: --{} is for --lattices and --beziers; leave it out", param.name));
    return;
  }
  throw UsageError(fmt::format("animate: a {} is moved by control points; give {}",
                               kindName(in.operands[0].kind()),
                               in.operands[0].kind() == Kind::Scene ? "--beziers" : "--lattices"));
}

/// Refuses frames that would write over the file of a key.
void requireApartFromKeys(const Invocation& in) {
  std::set<std::filesystem::path> read;
  for (const std::string& name : keyNames(in))
    if (name != kRest) read.insert(levelset::canonicalFile(name));
  for (const std::string& file : frameFiles(in)) {
    const std::filesystem::path written = levelset::canonicalFile(file);
    if (written.empty() || !read.contains(written)) continue;
    throw UsageError(fmt::format("animate: --out would write over '{}' of --{}; use other names",
                                 file, keyOption(in)));
  }
}

void validateControlPoints(const Invocation& in) {
  requireOwnOptions(in);
  const bool isScene = in.operands[0].kind() == Kind::Scene;
  if (isScene == in.given("lattices"))
    throw UsageError(
        isScene ? "animate: --lattices moves level sets, meshes and point clouds, but the operand "
                  "is a scene; give --beziers"
                : "animate: --beziers needs a scene with a Bézier volume, as 'read volume.json' "
                  "makes it; give --lattices to move the operand");
  const std::vector<std::string> names = keyNames(in);
  if (std::all_of(names.begin(), names.end(), [](const auto& name) { return name == kRest; }))
    throw UsageError(fmt::format("{}: no file is given; give a file for each key, as 'rest a.json'",
                                 in.where(keyOption(in))));
  (void)framesOfKeys(in);
  const FileSequence sequence(in.text("out"));
  if (!sequence.hasNumber())
    throw UsageError(fmt::format(
        "{}: '{}' is not a sequence of files; write # for the number, as in frame_###.{}",
        in.where("out"), sequence.pattern(), isScene ? "png" : "vdb"));
  requireApartFromKeys(in);
  Invocation writer = writerOf(in, sequence.file(0).string());
  writer.operands = {
      Value(Plan{.kind = writesMeshOfBand(in) ? Kind::Mesh : in.operands[0].kind()})};
  writer.op().validate(writer);
  if (writesPictures(in) && !isScene && !(in.given("from") && in.given("to")))
    throw UsageError(
        "animate: all pictures need the same view; give --from and --to, and --size for another "
        "number of pixels");
}

// === Frames

/// Writes the values of frames, and passes warnings on once.
class FrameWriter {
 public:
  explicit FrameWriter(Invocation& in) : in_(in), files_(frameFiles(in)) {}

  void write(std::size_t frame, const Value& value, const levelset::Progress& progress) {
    Invocation writer = writerOf(in_, files_[frame]);
    writer.operands = {writesMeshOfBand(in_) ? Value(levelset::bandToMesh(value.band())) : value};
    writer.operandNames = {""};
    writer.maxMemory = in_.maxMemory;
    writer.progress = progress;
    (void)writer.op().run(writer);
    for (const std::string& warning : writer.notes.warnings)
      if (told_.insert(warning).second) in_.notes.warnings.push_back(warning);
  }

 private:
  Invocation& in_;
  std::vector<std::string> files_;
  std::set<std::string> told_;
};

levelset::KeyInterpolation interpolationOf(const Invocation& in) {
  return in.text("interpolation") == "smooth" ? levelset::KeyInterpolation::Smooth
                                              : levelset::KeyInterpolation::Linear;
}

/// Weights of the keys in each frame.
std::vector<std::vector<KeyWeight>> weightsOf(const Invocation& in) {
  std::vector<double> times;
  for (const std::size_t frame : framesOfKeys(in)) times.push_back(static_cast<double>(frame));
  std::vector<std::vector<KeyWeight>> weights;
  for (std::size_t f = 0; f < framesOf(in); ++f)
    weights.push_back(levelset::keyWeights(times, static_cast<double>(f), interpolationOf(in)));
  return weights;
}

/// Place of a frame among the keys, for messages.
std::string frameText(const Invocation& in, std::size_t frame) {
  const std::vector<std::size_t> keys = framesOfKeys(in);
  const auto next = std::upper_bound(keys.begin(), keys.end(), frame);
  if (next == keys.end() || *std::prev(next) == frame) return fmt::format("frame {}", frame);
  return fmt::format("frame {}, between the keys of frames {} and {}", frame, *std::prev(next),
                     *next);
}

/// Reads the file of each key; a key `rest` is made of any file. Each file is read once.
template <class Key>
std::vector<Key> readKeys(const Invocation& in,
                          const std::function<Key(const std::string& file)>& read,
                          const std::function<Key(const Key& any)>& atRest) {
  const std::vector<std::string> names = keyNames(in);
  std::map<std::string, Key> files;
  for (const std::string& name : names)
    if (name != kRest && !files.contains(name)) files.emplace(name, read(name));
  std::vector<Key> keys;
  for (const std::string& name : names)
    keys.push_back(name == kRest ? atRest(files.begin()->second) : files.at(name));
  return keys;
}

Json framesJson(const std::vector<std::vector<KeyWeight>>& weights) {
  Json frames = Json::array();
  for (const std::vector<KeyWeight>& of : weights) {
    Json keys = Json::array();
    for (const KeyWeight& key : of) keys.push_back({{"key", key.key}, {"weight", key.weight}});
    frames.push_back({{"keys", std::move(keys)}});
  }
  return frames;
}

bool isSameKey(const std::vector<KeyWeight>& a, const std::vector<KeyWeight>& b) {
  return a.size() == 1 && b.size() == 1 && a.front().key == b.front().key;
}

constexpr double kCertifying = 0.1;  // share of the certificates in the progress

Value animateLattices(Invocation& in) {
  const std::vector<ControlLattice> keys = readKeys<ControlLattice>(
      in, [&](const std::string& file) { return levelset::readLattice(file, in.maxMemory); },
      [](const ControlLattice& any) {
        if (any.isRational())
          throw levelset::InvalidInput(
              "'rest' needs lattices without weights, but a lattice has weights; give a "
              "file for each key");
        return levelset::identityLattice(any.data().axes, any.data().boxToWorld);
      });
  levelset::requireSameLattices(keys);
  const std::vector<std::vector<KeyWeight>> weights = weightsOf(in);
  const auto frames = static_cast<double>(weights.size());
  Json details = {{"frames", weights.size()}, {"frame", framesJson(weights)}};
  // All frames are certified before the first one is written.
  std::size_t worst = 0, reused = 0;
  double least = 0;
  for (std::size_t f = 0; f < weights.size(); ++f) {
    const levelset::FoldCertificate certificate = levelset::withContext(frameText(in, f), [&] {
      const auto found =
          levelset::certifyLattice(levelset::latticeBetween(keys, weights[f]),
                                   {.maxMemory = in.maxMemory,
                                    .progress = levelset::subProgress(
                                        in.progress, kCertifying * static_cast<double>(f) / frames,
                                        kCertifying * static_cast<double>(f + 1) / frames)});
      levelset::requireInjective(found);
      return found;
    });
    details["frame"][f]["certificate"] = foldCertificateJson(certificate);
    if (f > 0 && certificate.leastLow >= least) continue;
    least = certificate.leastLow;
    worst = f;
  }
  FrameWriter writer(in);
  std::optional<Value> value;
  for (std::size_t f = 0; f < weights.size(); ++f) {
    const auto share = [&](double of) {
      return kCertifying + (1 - kCertifying) * (static_cast<double>(f) + of) / frames;
    };
    constexpr double kDeforming = 0.7;
    if (value && isSameKey(weights[f], weights[f - 1])) {
      ++reused;
    } else {
      DeformValueOptions options{
          .maxMemory = in.maxMemory,
          .progress = levelset::subProgress(in.progress, share(0), share(kDeforming))};
      if (in.given("voxel")) options.voxelSize = in.length("voxel");
      if (in.given("half-width")) options.halfWidth = in.number("half-width");
      value = levelset::withContext(frameText(in, f), [&] {
        return deformed(in.operands[0],
                        levelset::LatticeDeformation(levelset::latticeBetween(keys, weights[f])),
                        options)
            .value;
      });
    }
    writer.write(f, *value, levelset::subProgress(in.progress, share(kDeforming), share(1)));
  }
  details["reused"] = reused;
  in.notes.detailsJson = details.dump();
  in.notes.notes.push_back(
      fmt::format("{} frames; the Jacobian is least in frame {}: {:.4g} or more", weights.size(),
                  worst, least));
  return std::move(*value);
}

Value animateBeziers(Invocation& in) {
  render::ViewedScene viewed = in.operands[0].scene();
  if (viewed.scene.beziers.size() != 1)
    throw levelset::InvalidInput(
        fmt::format("the scene has {} Bézier volumes, but one is moved; give a scene with one",
                    viewed.scene.beziers.size()));
  if (writesPictures(in) && !viewed.hasCamera && !(in.given("from") && in.given("to")))
    throw UsageError(
        "animate: all pictures need the same view, and the scene has none; give --from and --to");
  const BezierVolume own = viewed.scene.beziers.front().caster.volume();
  const std::vector<BezierVolume> keys = readKeys<BezierVolume>(
      in, [&](const std::string& file) { return render::readBezierVolume(file, in.maxMemory); },
      [&](const BezierVolume&) { return own; });
  render::requireSameVolumes(keys);
  const std::vector<std::vector<KeyWeight>> weights = weightsOf(in);
  const auto frames = static_cast<double>(weights.size());
  FrameWriter writer(in);
  for (std::size_t f = 0; f < weights.size(); ++f) {
    viewed.scene.beziers.front().caster = levelset::withContext(frameText(in, f), [&] {
      return render::BezierCaster(render::volumeBetween(keys, weights[f]), in.maxMemory);
    });
    writer.write(f, Value(viewed),
                 levelset::subProgress(in.progress, static_cast<double>(f) / frames,
                                       static_cast<double>(f + 1) / frames));
  }
  in.notes.detailsJson = Json{{"frames", weights.size()}, {"frame", framesJson(weights)}}.dump();
  return Value(std::move(viewed));
}

/// The options of `render` for pictures, as `animate` shows them.
std::vector<Param> pictureParams() {
  std::vector<Param> params;
  addCameraParams(params);
  for (const Param& param : renderOperator().params)
    if (kPictureOptions.contains(param.name)) params.push_back(param);
  for (Param& param : params) param.doc = "for pictures of moved control points: " + param.doc;
  return params;
}

}  // namespace

Operator withControlPoints(Operator animate) {
  const Operator textures = animate;
  animate.aloneWith = {"lattices", "beziers"};
  animate.operands[0] = {Kind::Band, Kind::Mesh, Kind::Points, Kind::Scene};
  animate.params.push_back(
      {.name = "lattices",
       .type = ParamType::Path,
       .doc = "lattice files of the key frames, separated by blanks; 'rest' moves nothing. They "
              "differ in their control points only, which are interpolated in the frames between"});
  animate.params.push_back(
      {.name = "beziers",
       .type = ParamType::Path,
       .doc = "files of Bézier volumes, separated by blanks, as --lattices; 'rest' is the volume "
              "of the scene"});
  animate.params.push_back(
      {.name = "interpolation",
       .type = ParamType::Choice,
       .doc = "motion of control points between keys: linear, or smooth, with a velocity that is "
              "continuous, and zero at the first and the last key",
       .fallback = "linear",
       .choices = {"linear", "smooth"}});
  for (Param& param : pictureParams()) animate.params.push_back(std::move(param));
  animate.resultKind = [textures](const Invocation& in) {
    return isAlone(in) && !in.operands.empty() ? in.operands[0].kind() : textures.resultKind(in);
  };
  animate.run = [textures](Invocation& in) {
    if (!isAlone(in)) return textures.run(in);
    return in.given("lattices") ? animateLattices(in) : animateBeziers(in);
  };
  animate.plan = [textures](Invocation& in) {
    return isAlone(in) ? in.operands[0].plan() : textures.plan(in);
  };
  animate.validate = [textures](const Invocation& in) {
    if (isAlone(in)) return validateControlPoints(in);
    requireTextureOptions(in);
    textures.validate(in);
  };
  animate.targets = [textures](const Invocation& in) {
    return isAlone(in) ? frameFiles(in) : textures.targets(in);
  };
  return animate;
}

}  // namespace pipeline
