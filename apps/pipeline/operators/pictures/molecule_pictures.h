#pragma once

#include <vector>

#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/registry/operator.h"
#include "levelset/molecules/molecule_model.h"
#include "render/views/scene_file.h"

/// The parts of the operator `render` that concern molecules.
namespace pipeline {

/// Names of the styles of molecules, as options have them.
[[nodiscard]] std::vector<std::string> moleculeStyleNames();
/// @param name  one of moleculeStyleNames()
[[nodiscard]] levelset::MoleculeStyle moleculeStyleNamed(const std::string& name);

/// Options --atoms and --colour-by of `render`.
[[nodiscard]] std::vector<Param> moleculePictureParams();
/// Refuses these options with other operands than a molecule.
/// @throws UsageError
void validateMoleculePicture(const Invocation& in);
/// Scene with exact balls and sticks of a molecule.
/// @throws as levelset::moleculeModel
[[nodiscard]] render::ViewedScene moleculeScene(Invocation& in);

}  // namespace pipeline
