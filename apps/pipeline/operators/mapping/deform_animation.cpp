#include "apps/pipeline/operators/mapping/deform_animation.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
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
#include "levelset/deform/cage/cage.h"
#include "levelset/deform/keys/lattice_keys.h"
#include "levelset/deform/keys/motion_certificate.h"
#include "levelset/deform/lattice_certificate.h"
#include "levelset/deform/lattice_file.h"
#include "levelset/error.h"
#include "levelset/file_target.h"
#include "levelset/mesh_files/mesh_file.h"
#include "levelset/meshing/band_to_mesh.h"
#include "render/bezier/keys/bezier_keys.h"
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
  return in.given("lattices") ? "lattices" : in.given("cages") ? "cages" : "beziers";
}

bool isAlone(const Invocation& in) {
  return in.given("lattices") || in.given("cages") || in.given("beziers");
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
  const std::size_t count = keyNames(in).size();
  if (in.given("lattices")) return keyFrames(in, count, "lattice", "lattices");
  if (in.given("cages")) return keyFrames(in, count, "cage", "cages");
  return keyFrames(in, count, "Bézier volume", "Bézier volumes");
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
  const bool movesOperand = !in.given("beziers");
  if (int{in.given("lattices")} + int{in.given("cages")} + int{in.given("beziers")} > 1)
    throw UsageError(
        "animate: --lattices, --cages and --beziers exclude each other; give one of them");
  if (in.given("cages") && !in.given("cage"))
    throw UsageError("animate: --cage is missing; give the mesh file of the cage at rest");
  for (const char* name : {"cage", "coordinates"})
    if (in.given(name) && !in.given("cages"))
      throw UsageError(fmt::format("animate: --{} is for --cages; leave it out", name));
  for (const Param& param : in.op().params) {
    if (!in.given(param.name)) continue;
    const bool isForPictures = isPictureOption(param.name);
    if (isForPictures && !writesPictures(in))
      throw UsageError(fmt::format(
          "animate: --{} is for pictures, but --out names no .png or .exr; leave it out",
          param.name));
    const bool isOwn = isForPictures || kCommonOptions.contains(param.name) ||
                       param.name == keyOption(in) || param.name == "interpolation" ||
                       param.name == "cage" || param.name == "coordinates";
    if (!isOwn)
      throw UsageError(
          fmt::format("animate: --{} is for textures, but --{} moves control points; leave it out",
                      param.name, keyOption(in)));
  }
  for (const char* name : {"voxel", "half-width"})
    if (in.given(name) && (!movesOperand || in.operands[0].kind() != Kind::Band))
      throw UsageError(fmt::format("animate: --{} is for level sets; leave it out", name));
}

/// Refuses options of control points beside a texture.
void requireTextureOptions(const Invocation& in) {
  if (in.operands.empty() || in.operands[0].kind() == Kind::Band) {
    for (const Param& param : in.op().params)
      if (in.given(param.name) && (isPictureOption(param.name) || param.name == "interpolation" ||
                                   param.name == "cage" || param.name == "coordinates"))
        throw UsageError(fmt::format(
            "animate: --{} is for --lattices, --cages and --beziers; leave it out", param.name));
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
  if (in.given("cage")) read.insert(levelset::canonicalFile(in.text("cage")));
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
  if (isScene != in.given("beziers"))
    throw UsageError(
        isScene ? fmt::format("animate: --{} moves level sets, meshes and point clouds, but the "
                              "operand is a scene; give --beziers",
                              keyOption(in))
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

/// Proves that lattices do not fold between the frames either, from key to key. A fold there is a
/// warning: no frame shows it.
Json motionJson(Invocation& in, const std::vector<ControlLattice>& keys,
                const levelset::Progress& progress) {
  std::vector<double> times;
  for (const std::size_t frame : framesOfKeys(in)) times.push_back(static_cast<double>(frame));
  Json list = Json::array();
  for (std::size_t k = 0; k + 1 < keys.size(); ++k) {
    levelset::MotionCertificate found;
    std::vector<ControlLattice> control;
    // Weights of control values may be negative, which rational lattices refuse.
    if (!keys[k].isRational())
      for (const auto& weights : levelset::motionWeights(times, k, interpolationOf(in)))
        control.push_back(levelset::latticeBetween(keys, weights));
    if (!control.empty())
      found = levelset::certifyMotion(
          control, {.maxMemory = in.maxMemory,
                    .progress = levelset::subProgress(
                        progress, static_cast<double>(k) / static_cast<double>(keys.size() - 1),
                        static_cast<double>(k + 1) / static_cast<double>(keys.size() - 1))});
    const double time = times[k] + found.time * (times[k + 1] - times[k]);
    Json entry = {{"from", times[k]},
                  {"to", times[k + 1]},
                  {"verdict", levelset::foldVerdictName(found.verdict)},
                  {"boxes", found.boxes}};
    if (found.boxes > 0 && std::isfinite(found.leastLow))
      entry["least_jacobian_low"] = found.leastLow;
    if (found.boxes > 0 && std::isfinite(found.leastHigh)) {
      entry["least_jacobian_high"] = found.leastHigh;
      entry["least_jacobian_frame"] = time;
    }
    list.push_back(std::move(entry));
    if (found.verdict == levelset::FoldVerdict::Folds)
      in.notes.warnings.push_back(fmt::format(
          "animate: the motion folds at frame {:.4g}, between two frames. The frames that are "
          "written are proven. Give a key between them if you draw more frames.",
          time));
    else if (found.verdict == levelset::FoldVerdict::Undecided)
      in.notes.warnings.push_back(fmt::format(
          "animate: there is no proof for the motion between frames {} and {}; it may fold there. "
          "Each frame is proven. Use lattices without weights or of a lower degree, or add a key "
          "between them, for a proof.",
          times[k], times[k + 1]));
  }
  return list;
}

/// Deforms the operand by the map of each frame, and writes the results.
/// @param begin  progress so far
Value writeDeformed(
    Invocation& in, const std::vector<std::vector<KeyWeight>>& weights, double begin,
    const std::function<std::unique_ptr<levelset::Deformation>(std::size_t frame)>& mapOf,
    Json& details) {
  const auto frames = static_cast<double>(weights.size());
  FrameWriter writer(in);
  std::optional<Value> value;
  std::size_t reused = 0;
  Json certificate;
  for (std::size_t f = 0; f < weights.size(); ++f) {
    const auto share = [&](double of) {
      return begin + (1 - begin) * (static_cast<double>(f) + of) / frames;
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
      DeformedValue result = levelset::withContext(
          frameText(in, f), [&] { return deformed(in.operands[0], *mapOf(f), options); });
      value = std::move(result.value);
      certificate = foldCertificateJson(result.certificate);
    }
    if (!details["frame"][f].contains("certificate"))
      details["frame"][f]["certificate"] = certificate;
    writer.write(f, *value, levelset::subProgress(in.progress, share(kDeforming), share(1)));
  }
  details["reused"] = reused;
  return std::move(*value);
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
  std::size_t worst = 0;
  double least = 0;
  for (std::size_t f = 0; f < weights.size(); ++f) {
    const levelset::FoldCertificate certificate = levelset::withContext(frameText(in, f), [&] {
      const auto found = levelset::certifyLattice(
          levelset::latticeBetween(keys, weights[f]),
          {.maxMemory = in.maxMemory,
           .progress = levelset::subProgress(
               in.progress, 0.5 * kCertifying * static_cast<double>(f) / frames,
               0.5 * kCertifying * static_cast<double>(f + 1) / frames)});
      levelset::requireInjective(found);
      return found;
    });
    details["frame"][f]["certificate"] = foldCertificateJson(certificate);
    if (f > 0 && certificate.leastLow >= least) continue;
    least = certificate.leastLow;
    worst = f;
  }
  details["motion"] =
      motionJson(in, keys, levelset::subProgress(in.progress, 0.5 * kCertifying, kCertifying));
  Value value = writeDeformed(
      in, weights, kCertifying,
      [&](std::size_t f) {
        return std::make_unique<levelset::LatticeDeformation>(
            levelset::latticeBetween(keys, weights[f]));
      },
      details);
  in.notes.detailsJson = details.dump();
  in.notes.notes.push_back(
      fmt::format("{} frames; the Jacobian is least in frame {}: {:.4g} or more", weights.size(),
                  worst, least));
  return value;
}

Value animateCages(Invocation& in) {
  const levelset::TriMesh rest =
      levelset::readMesh(in.text("cage"), {.attributes = false, .maxMemory = in.maxMemory});
  const std::vector<levelset::TriMesh> keys = readKeys<levelset::TriMesh>(
      in,
      [&](const std::string& file) {
        return levelset::readMesh(file, {.attributes = false, .maxMemory = in.maxMemory});
      },
      [&](const levelset::TriMesh&) { return rest; });
  const auto coordinates = in.text("coordinates") == "green" ? levelset::CageCoordinates::Green
                                                             : levelset::CageCoordinates::MeanValue;
  // Checks the triangles of all keys.
  std::optional<levelset::CageDeformation> cage;
  for (std::size_t k = 0; k < keys.size(); ++k)
    levelset::withContext(fmt::format("cage {}", k + 1),
                          [&] { cage.emplace(rest, keys[k], coordinates); });
  const std::vector<std::vector<KeyWeight>> weights = weightsOf(in);
  Json details = {{"frames", weights.size()}, {"frame", framesJson(weights)}};
  Value value = writeDeformed(
      in, weights, 0,
      [&](std::size_t f) {
        std::vector<Imath::V3d> moved;
        for (std::size_t v = 0; v < rest.positions.size(); ++v)
          moved.push_back(levelset::blendOf(
              weights[f], [&](std::size_t key) { return keys[key].positions[v]; }));
        return std::make_unique<levelset::CageDeformation>(cage->withMoved(std::move(moved)));
      },
      details);
  in.notes.detailsJson = details.dump();
  return value;
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
  animate.aloneWith = {"lattices", "cages", "beziers"};
  animate.operands[0] = {Kind::Band, Kind::Mesh, Kind::Points, Kind::Scene};
  animate.params.push_back(
      {.name = "lattices",
       .type = ParamType::Path,
       .doc = "lattice files of the key frames, separated by blanks; 'rest' moves nothing. They "
              "differ in their control points only, which are interpolated in the frames between"});
  animate.params.push_back(
      {.name = "cages",
       .type = ParamType::Path,
       .doc = "mesh files of moved cages, separated by blanks, as --lattices; 'rest' is the cage "
              "at rest"});
  animate.params.push_back({.name = "cage",
                            .type = ParamType::Path,
                            .doc = "for --cages: mesh file of the closed cage at rest"});
  animate.params.push_back({.name = "coordinates",
                            .type = ParamType::Choice,
                            .doc = "for --cages: coordinates of a cage, as of deform",
                            .fallback = "mean-value",
                            .choices = {"mean-value", "green"}});
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
    return in.given("lattices") ? animateLattices(in)
           : in.given("cages")  ? animateCages(in)
                                : animateBeziers(in);
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
