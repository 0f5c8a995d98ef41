#include <fmt/core.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/pictures/camera_options.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/terrain/height_pyramid.h"
#include "levelset/terrain/tiles/tiled_ground.h"
#include "render/terrain/terrain_detail.h"
#include "render/terrain/terrain_patch.h"

namespace pipeline {
namespace {

constexpr int kPatchCells = 32;  // cells along a side of a patch, see docs/terrain.md

/// Triangles of the patches that the picture needs.
Value meshOfPatches(Invocation& in, std::shared_ptr<const levelset::PatchStore> store,
                    const render::Camera& camera) {
  const int samples = store->layout().pyramid.cells + 1;
  render::TerrainDetail detail(std::move(store), {.maxBytes = in.maxMemory});
  const render::TerrainSelection selection = detail.select(camera, in.number("pixel-error"));
  for (std::string& warning : detail.takeWarnings())
    in.notes.warnings.push_back(in.op().name + ": " + std::move(warning));
  levelset::TriMesh mesh = render::terrainTriangles(detail.layout(), selection);
  if (mesh.isEmpty())
    throw levelset::InvalidInput("the picture shows no ground; move the camera with --from, --to");
  in.notes.notes.push_back(fmt::format(
      "{}: {} triangles in {} patch{} of {}x{} samples{}", in.op().name, mesh.triangles.size(),
      selection.parts.size(), selection.parts.size() == 1 ? "" : "es", samples, samples,
      selection.isComplete ? "" : "; not all patches that the pixel error needs"));
  return Value(std::move(mesh));
}

Value makeTerrainMesh(Invocation& in) {
  const levelset::HeightField& terrain = in.operands[0].terrain();
  levelset::requireLengths(terrain);
  const render::Camera camera = cameraOf(in, in.operands[0].plan().bounds);
  levelset::HeightPyramid pyramid = levelset::heightPyramid(
      terrain, {.cells = kPatchCells, .maxMemory = in.maxMemory, .progress = in.progress});
  // The operand stays where it is; the store only reads it.
  const std::shared_ptr<const levelset::HeightField> field(&terrain, [](const auto*) {});
  return meshOfPatches(in, levelset::patchStoreOf(field, std::move(pyramid)), camera);
}

/// Box of the ground of a tiled file.
Imath::Box3d boxOfTiles(const levelset::GroundLayout& layout) {
  const render::PatchGrid grid(layout);
  return grid.box(grid.root());
}

Value makeTiledMesh(Invocation& in) {
  std::shared_ptr<const levelset::PatchStore> store =
      levelset::openTiledGround(in.text("file"), in.maxMemory);
  levelset::requireLengths(store->layout().isGeographic);
  const Imath::Box3d box = boxOfTiles(store->layout());
  if (box.isEmpty())
    throw levelset::InvalidInput(
        fmt::format("'{}' has no known height; give another file", in.text("file")));
  const render::Camera camera = cameraOf(in, box);
  return meshOfPatches(in, std::move(store), camera);
}

Kind kindMesh(const Invocation&) {
  return Kind::Mesh;
}

Plan planTerrainMesh(Invocation& in) {
  return {.kind = Kind::Mesh, .bounds = in.operands[0].plan().bounds};
}

Plan planTiledMesh(Invocation& in) {
  const levelset::TiledGroundInfo info = levelset::tiledGroundInfo(in.text("file"), in.maxMemory);
  return {.kind = Kind::Mesh, .bounds = boxOfTiles(info.layout)};
}

void validateTiledMesh(const Invocation& in) {
  if (!levelset::isTiledGroundFormat(in.text("file")))
    throw levelset::UsageError(
        fmt::format("tiled-terrain-mesh: '{}' is no name of a tiled terrain; give a file that ends "
                    "in .lst, or use 'read {} ! terrain-mesh'",
                    in.text("file"), in.text("file")));
  validateCamera(in);
}

std::vector<Param> meshParams() {
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
  return params;
}

}  // namespace

Operator terrainMeshOperator() {
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
      .params = meshParams(),
      .operands = {{Kind::Terrain}},
      .resultKind = kindMesh,
      .run = makeTerrainMesh,
      .plan = planTerrainMesh,
      .validate = validateCamera,
  };
}

Operator tiledTerrainMeshOperator() {
  Operator op{
      .name = "tiled-terrain-mesh",
      .group = "Terrain",
      .summary = "make the triangles of a tiled terrain file that a picture needs",
      .details =
          "As 'terrain-mesh', but the terrain may be larger than the memory: only the patches that "
          "the picture needs are read. Where --max-memory does not suffice for the pixel error, "
          "coarser patches are taken, and a note tells it.",
      .example =
          "levelsmith read <(printf 'ncols 3\\nnrows 3\\nxllcorner 0\\nyllcorner 0\\ncellsize "
          "1\\n0 1 0\\n1 2 1\\n0 1 0\\n') --format asc ! write small.lst ! "
          "tiled-terrain-mesh small.lst --from 1,-5,3 --pixel-error 2 ! info",
      .params = {{.name = "file",
                  .type = ParamType::Path,
                  .doc = "tiled terrain, .lst",
                  .required = true,
                  .position = 0}},
      .resultKind = kindMesh,
      .run = makeTiledMesh,
      .plan = planTiledMesh,
      .validate = validateTiledMesh,
  };
  for (Param& param : meshParams()) op.params.push_back(std::move(param));
  return op;
}

}  // namespace pipeline
