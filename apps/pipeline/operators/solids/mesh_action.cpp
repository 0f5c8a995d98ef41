#include "apps/pipeline/operators/solids/mesh_action.h"

#include "apps/pipeline/operators/level_set_operator.h"
#include "levelset/error.h"
#include "levelset/meshing/band_to_mesh.h"
#include "mapping/patches/patch_mesh.h"

namespace pipeline {
namespace {

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
  if (isPatch(in) && (in.given("adaptivity") || in.flag("sharp")))
    throw levelset::UsageError(
        "mesh: --adaptivity and --sharp apply to level sets, not to a patch; leave them out");
  if (!isPatch(in) && in.flag("sheets"))
    throw levelset::UsageError("mesh: --sheets is for a patch, not for a level set; leave it out");
}

}  // namespace

Operator meshOperator() {
  Operator op = levelSetOperator<levelset::MeshOperator>(
      {.params = {{.name = "sheets",
                   .type = ParamType::Flag,
                   .doc = "for patches: make an open mesh of each layer of particles, in place of "
                          "one closed surface"}},
       .validate = validateMesh});
  op.operands = {{Kind::Band, Kind::Patch}};
  op.run = [ofBand = op.run](Invocation& in) {
    if (!isPatch(in)) return ofBand(in);
    return Value(meshOfPatches(
        in.operands[0].patch().patches,
        in.flag("sheets") ? mapping::PatchMeshKind::Sheets : mapping::PatchMeshKind::Solid));
  };
  return op;
}

}  // namespace pipeline
