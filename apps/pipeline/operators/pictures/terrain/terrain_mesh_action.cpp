#include <fmt/core.h>

#include <memory>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/pictures/camera_options.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/terrain/height_pyramid.h"
#include "render/terrain/terrain_detail.h"

namespace pipeline {
namespace {

constexpr int kPatchCells = 32;  // cells along a side of a patch, see docs/terrain.md

Value makeTerrainMesh(Invocation& in) {
  const levelset::HeightField& terrain = in.operands[0].terrain();
  levelset::requireLengths(terrain);
  const render::Camera camera = cameraOf(in, in.operands[0].plan().bounds);
  levelset::HeightPyramid pyramid = levelset::heightPyramid(
      terrain, {.cells = kPatchCells, .maxMemory = in.maxMemory, .progress = in.progress});
  // The operand stays where it is; the store only reads it.
  const std::shared_ptr<const levelset::HeightField> field(&terrain, [](const auto*) {});
  render::TerrainDetail detail(levelset::patchStoreOf(field, std::move(pyramid)),
                               {.maxBytes = in.maxMemory});
  const render::TerrainSelection selection = detail.select(camera, in.number("pixel-error"));
  levelset::TriMesh mesh = render::terrainTriangles(detail.layout(), selection);
  if (mesh.isEmpty())
    throw levelset::InvalidInput("the picture shows no ground; move the camera with --from, --to");
  in.notes.notes.push_back(
      fmt::format("terrain-mesh: {} triangles in {} patch{} of {}x{} samples{}",
                  mesh.triangles.size(), selection.parts.size(),
                  selection.parts.size() == 1 ? "" : "es", kPatchCells + 1, kPatchCells + 1,
                  selection.isComplete ? "" : "; memory does not suffice for the pixel error"));
  return Value(std::move(mesh));
}

Kind kindMesh(const Invocation&) {
  return Kind::Mesh;
}

Plan planTerrainMesh(Invocation& in) {
  return {.kind = Kind::Mesh, .bounds = in.operands[0].plan().bounds};
}

}  // namespace

Operator terrainMeshOperator() {
  std::vector<Param> params = {
      {.name = "pixel-error",
       .type = ParamType::Number,
       .doc = "largest distance in the picture between a ground point and the mesh above or below "
              "it, pixels",
       .fallback = "1",
       .range = Range::Positive}};
  addCameraParams(params);
  for (Param& param : params) {
    if (param.name == "up") param.fallback = "0,0,1";
    if (param.name == "from")
      param.doc = "position of the eye; default: a three-quarter view of the terrain";
    if (param.name == "to")
      param.doc = "point that the camera looks at; default: the middle of the terrain";
  }
  return {
      .name = "terrain-mesh",
      .group = "Terrain",
      .summary = "make the triangles of a terrain that a picture needs",
      .details =
          "The mesh covers the part of the ground that the camera sees, with larger triangles far "
          "away. Its vertices are samples, and it has no cracks. Samples without data leave "
          "holes.",
      .example =
          "levelsmith read <(printf 'ncols 3\\nnrows 3\\nxllcorner 0\\nyllcorner 0\\ncellsize "
          "1\\n0 1 0\\n1 2 1\\n0 1 0\\n') --format asc ! terrain-mesh --from 1,-5,3 "
          "--pixel-error 2 ! info",
      .params = params,
      .operands = {{Kind::Terrain}},
      .resultKind = kindMesh,
      .run = makeTerrainMesh,
      .plan = planTerrainMesh,
      .validate = validateCamera,
  };
}

}  // namespace pipeline
