#include "render/views/scene_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/pictures/camera_options.h"
#include "apps/pipeline/operators/pictures/volume_pictures.h"
#include "apps/pipeline/operators/terrain/terrain_pictures.h"
#include "apps/pipeline/operators/volume_params.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/units.h"
#include "levelset/error.h"
#include "render/scene/field_expression.h"

namespace pipeline {
namespace {

using levelset::UsageError;

std::vector<std::string> wordsOf(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// Returns the names of the parts, the operands of the scene: --names, otherwise those of --as,
/// otherwise part1, part2, …
std::vector<std::string> partNames(const Invocation& in) {
  std::vector<std::string> names;
  if (in.given("names")) {
    names = wordsOf(in.text("names"));
    if (names.size() != in.operands.size())
      throw UsageError(
          fmt::format("scene: --names gives {} names for {} parts; give one name for each part",
                      names.size(), in.operands.size()));
  } else {
    names = in.operandNames;
    names.resize(in.operands.size());
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i].empty()) names[i] = fmt::format("part{}", i + 1);
  }
  render::requireSceneNames(names);
  return names;
}

/// Returns the colours of --colours, or six default colours. The caller repeats the default colours
/// for further parts.
std::vector<Imath::C3f> partColours(const Invocation& in) {
  std::vector<Imath::C3f> colours;
  if (in.given("colours")) {
    for (const Imath::V3d& colour : in.points("colours")) {
      for (int c = 0; c < 3; ++c)
        if (!(colour[c] >= 0 && colour[c] <= 1))
          throw UsageError(fmt::format(
              "scene: --colours {},{},{} is not a colour; give red, green and blue from 0 to 1",
              colour.x, colour.y, colour.z));
      colours.emplace_back(colour);
    }
  } else {
    colours = {{0.66f, 0.62f, 0.56f}, {0.35f, 0.50f, 0.66f}, {0.70f, 0.42f, 0.32f},
               {0.42f, 0.58f, 0.40f}, {0.62f, 0.52f, 0.68f}, {0.72f, 0.62f, 0.32f}};
  }
  return colours;
}

/// Returns the opacity of each part; 1 without --opacities.
std::vector<double> partOpacities(const Invocation& in) {
  std::vector<double> opacities(in.operands.size(), 1);
  if (!in.given("opacities")) return opacities;
  const std::vector<std::string> words = wordsOf(in.text("opacities"));
  if (words.size() != opacities.size())
    throw UsageError(
        fmt::format("scene: --opacities gives {} values for {} parts; give one value for each part",
                    words.size(), opacities.size()));
  for (std::size_t i = 0; i < words.size(); ++i) {
    opacities[i] = parseNumber(words[i], "scene: --opacities");
    if (!(opacities[i] > 0 && opacities[i] <= 1))
      throw UsageError(fmt::format(
          "scene: --opacities {} is out of range; give more than 0 and at most 1", words[i]));
  }
  return opacities;
}

/// Requires --transfer for a volume, and at most one volume. @throws UsageError
void requireVolumes(const Invocation& in) {
  const auto count =
      std::count_if(in.operands.begin(), in.operands.end(),
                    [](const Value& operand) { return isVolumeKind(operand.plan().kind); });
  if (count > 1)
    throw UsageError(fmt::format(
        "scene: {} of the parts are volumes, but a scene can have one; draw the others as surfaces "
        "with isosurface or isosurface-mesh",
        count));
  if (count == 1 && !in.given("transfer"))
    throw UsageError(
        "scene: a volume is drawn by direct volume rendering; give --transfer, as --transfer auto, "
        "or make a surface of it with isosurface");
  if (count == 0 && in.given("transfer"))
    throw UsageError("scene: --transfer is for volumes; leave it out");
}

Plan planScene(Invocation& in) {
  requireVolumes(in);
  Plan plan{.kind = Kind::Scene};
  for (const Value& operand : in.operands) {
    const Plan& one = operand.plan();
    plan.bounds.extendBy(one.bounds);
    plan.area += one.area;
    plan.halfWidth = std::max(plan.halfWidth, one.halfWidth);
    if (one.voxelSize == 0) continue;  // a mesh, which has no voxels
    plan.voxelSize = plan.voxelSize > 0 ? std::min(plan.voxelSize, one.voxelSize) : one.voxelSize;
  }
  // `vx` is the smallest voxel size of the parts, and `%` refers to the diagonal of all parts, so
  // lengths do not depend on the order of the parts.
  in.setReference(plan.voxelSize, plan.bounds.isEmpty() ? 0 : plan.bounds.size().length());
  return plan;
}

/// Takes the only part of a scene that `read` made of the file of a Bézier volume.
render::BezierPart bezierPart(const Value& operand, const std::string& name) {
  const render::Scene& scene = operand.scene().scene;
  const std::size_t others = scene.solids.size() + scene.meshes.size() + scene.quadrics.size() +
                             scene.terrains.size() + scene.mapped.size() +
                             (scene.volumePart ? 1 : 0) + (scene.segmented ? 1 : 0);
  if (scene.beziers.size() != 1 || others > 0)
    throw UsageError(
        fmt::format("scene: '{}' is a scene with other parts than one Bézier volume; list its "
                    "parts in the new scene, or edit its file",
                    name));
  return scene.beziers.front();
}

Value makeScene(Invocation& in) {
  (void)planScene(in);
  const std::vector<std::string> names = partNames(in);
  const std::vector<Imath::C3f> colours = partColours(in);
  const std::vector<double> opacities = partOpacities(in);
  if (in.given("colours") && colours.size() != in.operands.size())
    throw UsageError(
        fmt::format("scene: --colours gives {} colours for {} parts; give one colour for each part",
                    colours.size(), in.operands.size()));
  render::ViewedScene viewed;
  render::Scene& scene = viewed.scene;
  std::vector<std::string> solids, beziers;
  for (std::size_t i = 0; i < in.operands.size(); ++i) {
    const Imath::C3f& colour = colours[i % colours.size()];
    const auto id = static_cast<std::uint32_t>(i + 1);
    if (isVolumeKind(in.operands[i].kind())) {
      const levelset::Volume volume = volumeIn(in, i);
      const render::VolumeSurface surface(volume, volume.highest());
      scene.volumePart = volumePartOf(in, surface);
      scene.volumePart->name = names[i];
      continue;
    }
    if (in.operands[i].kind() == Kind::Terrain) {
      if (opacities[i] != 1)
        throw UsageError(fmt::format(
            "scene: --opacities {} makes the terrain '{}' transparent, which is not possible; give "
            "1 for it",
            opacities[i], names[i]));
      render::TerrainPart part = terrainPartOf(in, i);
      part.colour = colour;
      part.id = id;
      part.name = names[i];
      scene.terrains.push_back(std::move(part));
      continue;
    }
    if (in.operands[i].kind() == Kind::Mesh) {
      scene.meshes.push_back({std::make_shared<const levelset::TriMesh>(in.mesh(i)), colour, id,
                              names[i], opacities[i]});
      continue;
    }
    if (in.operands[i].kind() == Kind::Scene) {
      render::BezierPart part = bezierPart(in.operands[i], names[i]);
      // The file may have a colour, other than the default of all parts, and an opacity.
      if (in.given("colours") || part.colour == render::MeshPart().colour) part.colour = colour;
      if (in.given("opacities")) part.opacity = opacities[i];
      part.id = id;
      part.name = names[i];
      scene.beziers.push_back(std::move(part));
      beziers.push_back(names[i]);
      continue;
    }
    scene.solids.push_back({.band = in.band(i),
                            .colour = colour,
                            .id = id,
                            .name = names[i],
                            .opacity = opacities[i]});
    solids.push_back(names[i]);
  }
  if (in.given("csg")) {
    std::vector<std::string> operands = solids;
    operands.insert(operands.end(), beziers.begin(), beziers.end());
    scene.csg = render::CsgExpression(in.text("csg"), operands);
  }
  for (std::size_t i = 0; i < solids.size() && in.given("csg"); ++i)
    if (!scene.csg.uses(i))
      in.notes.warnings.push_back(
          fmt::format("scene: --csg does not name '{}', which is not drawn", solids[i]));
  if (in.given("soft")) scene.softness = in.length("soft");
  if (in.given("morph")) scene.morph = in.number("morph");
  render::requireOperands(scene);
  render::requireFields(scene);
  viewed.hasCamera = givesCamera(in);
  Imath::Box3d bounds = scene.bounds();
  bounds.extendBy(scene.volumeBounds());
  if (viewed.hasCamera) scene.camera = cameraOf(in, bounds);
  return Value(std::move(viewed));
}

void validateScene(const Invocation& in) {
  validateCamera(in);
  validateTransfer(in);
  validateTerrainPicture(in);
  if (in.given("soft") && !in.given("csg"))
    throw UsageError(
        "scene: --soft blends the solids of a CSG expression; give --csg, too, as --csg 'a | b'");
  if (!in.given("morph")) return;
  if (in.given("csg"))
    throw UsageError(
        "scene: --morph blends two solids and cannot be combined with --csg; leave one of them "
        "out");
  if (in.number("morph") < 0 || in.number("morph") > 1)
    throw UsageError(fmt::format("scene: --morph {} is out of range; give a number from 0 to 1",
                                 in.text("morph")));
}

}  // namespace

Operator sceneOperator() {
  Operator scene = {
      .name = "scene",
      .group = "Pictures",
      .summary =
          "combine level sets, meshes, terrains, Bézier volumes and a volume in one picture, or "
          "solids by a CSG expression",
      .details =
          "With --csg the rays of 'render' combine the solids: a | b is the union, a & b the "
          "intersection, a - b the difference. Solids are not resampled; each keeps its voxels. "
          "The expression uses the names that --as gave to the solids. Meshes and terrains are "
          "drawn "
          "beside them, meshes with the normals and colours of their vertices if they have any. "
          "Coincident "
          "surfaces on different grids are separated by rounding only, so let the subtracted solid "
          "protrude. --soft blends the distances to the solids: surfaces closer than this length "
          "merge. --morph interpolates between the distances of two solids. One part may be a "
          "volume, "
          "drawn by --transfer in front of, around and behind the surfaces. A Bézier volume that "
          "'read' has read may be a part, and an operand of --csg if its surface is closed. 'write "
          "scene.json' "
          "saves a scene without a volume, with the parts in files beside it.",
      .example =
          "levelsmith box --size 2,2,2 --voxel 0.05 --as b ! sphere --radius 1.3 --voxel "
          "0.03 --as s ! scene @b @s --csg 'b - s' ! render cut.png --size 320x240",
      .params =
          {{.name = "csg",
            .type = ParamType::Text,
            .doc = "CSG expression of the solids and Bézier volumes to draw, as '(a | b) - c'; "
                   "default: all parts"},
           {.name = "soft",
            .type = ParamType::Length,
            .doc = "with --csg: solids blend where their distances differ by less than this; at "
                   "most the half width of the narrowest band",
            .range = Range::NonNegative},
           {.name = "morph",
            .type = ParamType::Number,
            .doc = "for two solids: fraction of the blend of their distances; 0 draws the first "
                   "solid, 1 the second"},
           {.name = "names",
            .type = ParamType::Text,
            .doc = "names of the parts, separated by blanks; default: those of --as"},
           {.name = "colours",
            .type = ParamType::Points,
            .doc = "colours of the parts, red,green,blue from 0 to 1 each, separated by blanks; a "
                   "volume has the colours of --transfer instead"},
           {.name = "opacities",
            .type = ParamType::Text,
            .doc = "opacities of the parts, above 0 and up to 1, separated by blanks; below 1 a "
                   "surface is transparent in the layers R G B A and casts a weaker shadow; a "
                   "volume has the opacities of --transfer instead"}},
      .operands = {{Kind::Band, Kind::Mesh, Kind::Volume, Kind::Field, Kind::Scene, Kind::Terrain}},
      .takesMore = true,
      .readsNames = true,
      .resultKind = [](const Invocation&) { return Kind::Scene; },
      .run = makeScene,
      .plan = planScene,
      .validate = validateScene,
  };
  for (const Param& param : transferParams()) scene.params.push_back(param);
  for (const Param& param : terrainPictureParams()) scene.params.push_back(param);
  addCameraParams(scene.params);
  return scene;
}

}  // namespace pipeline
