#include "apps/pipeline/operators/solids/mesh_action.h"

#include <fmt/core.h>

#include "apps/pipeline/operators/level_set_operator.h"
#include "apps/pipeline/operators/solids/segment_actions.h"
#include "apps/pipeline/operators/terrain/terrain_figures.h"
#include "levelset/adaptive/adaptive_to_mesh.h"
#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"
#include "levelset/terrain/ground_mesh.h"
#include "mapping/patches/patch_mesh.h"

namespace pipeline {
namespace {

bool isSegmentation(const Invocation& in) {
  return in.operands[0].kind() == Kind::Segmentation;
}
bool isAdaptive(const Invocation& in) {
  return in.operands[0].kind() == Kind::Adaptive;
}
bool isPatch(const Invocation& in) {
  return in.operands[0].kind() == Kind::Patch;
}

/// Builds one mesh of all patches of a set.
levelset::TriMesh meshOfPatches(const std::vector<mapping::Patch>& patches,
                                mapping::PatchMeshKind kind) {
  levelset::TriMesh all;
  for (const mapping::Patch& patch : patches) append(all, mapping::patchMesh(patch, kind));
  return all;
}

void validateMesh(const Invocation& in) {
  for (const char* option : {"adaptivity", "sharp", "method", "original", "edge-length", "angle"})
    if (in.operands[0].kind() != Kind::Band && in.given(option))
      throw levelset::UsageError(
          fmt::format("mesh: --{} applies to a level set, not to {}; leave it out", option,
                      kindPhrase(in.operands[0].kind())));
  if (in.given("allow-missing") && !isTerrain(in))
    throw levelset::UsageError("mesh: --allow-missing is for a terrain; leave it out");
  if (in.given("label") && !isSegmentation(in))
    throw levelset::UsageError("mesh: --label is for a segmentation; leave it out");
  if (in.given("original") && in.text("method") != "extended")
    throw levelset::UsageError(
        "mesh: --original is for --method extended; give that method, or leave it out");
  if (!isPatch(in) && in.flag("sheets"))
    throw levelset::UsageError(
        fmt::format("mesh: --sheets is for a patch, not for {}; leave it out",
                    kindPhrase(in.operands[0].kind())));
}

void setOriginal(levelset::MeshOperator::Options& options, Invocation& in) {
  if (in.given("original")) options.original = &in.named.at("original").mesh();
}

}  // namespace

Operator meshOperator() {
  Operator op = levelSetOperator<levelset::MeshOperator>(
      {.params = {{.name = "original",
                   .type = ParamType::Mesh,
                   .doc = "mesh from which the level set was computed, for --method extended: its "
                          "crossings with the grid edges and its normals are used"},
                  {.name = "sheets",
                   .type = ParamType::Flag,
                   .doc = "for patches: make an open mesh of each layer of particles, in place of "
                          "one closed surface"},
                  {.name = "label",
                   .type = ParamType::Integer,
                   .doc = "for segmentations: make the closed surface of the region with this "
                          "label, in place of all interfaces",
                   .range = Range::Positive},
                  {.name = "allow-missing",
                   .type = ParamType::Flag,
                   .doc = "for terrains: leave holes where samples have no data"}},
       .validate = validateMesh,
       .prepare = setOriginal});
  op.operands = {{Kind::Band, Kind::Patch, Kind::Adaptive, Kind::Segmentation, Kind::Terrain}};
  op.run = [ofBand = op.run](Invocation& in) {
    if (isAdaptive(in))
      return Value(levelset::adaptiveToMesh(in.operands[0].adaptive(),
                                            {.maxMemory = in.maxMemory, .progress = in.progress}));
    if (isSegmentation(in)) return meshOfSegmentation(in);
    if (isTerrain(in))
      return Value(levelset::groundMesh(
          in.operands[0].terrain(),
          {.allowMissing = in.flag("allow-missing"), .maxMemory = in.maxMemory}));
    if (!isPatch(in)) return ofBand(in);
    return Value(meshOfPatches(
        in.operands[0].patch().patches,
        in.flag("sheets") ? mapping::PatchMeshKind::Sheets : mapping::PatchMeshKind::Solid));
  };
  return op;
}

}  // namespace pipeline
