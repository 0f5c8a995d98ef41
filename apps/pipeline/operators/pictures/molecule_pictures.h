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

/// Options --ball-scale, --stick-radius and --file-bonds. @param of  begins the help texts
[[nodiscard]] std::vector<Param> moleculeModelParams(const std::string& of = "");
/// Refuses these options where the style has no such parts. @param style  option with the style
/// @throws UsageError
void validateMoleculeModel(const Invocation& in, const std::string& style);
/// Style and sizes of a model. @param style  option with the style
[[nodiscard]] levelset::MoleculeModelOptions moleculeModelOptions(Invocation& in,
                                                                  const std::string& style);

/// Options --atoms, --colour-by, --blue-at, --red-at and moleculeModelParams() of `render`.
[[nodiscard]] std::vector<Param> moleculePictureParams();
/// Refuses these options with other operands than a molecule.
/// @throws UsageError
void validateMoleculePicture(const Invocation& in);
/// Scene with exact balls and sticks of a molecule.
/// @throws as levelset::moleculeModel
[[nodiscard]] render::ViewedScene moleculeScene(Invocation& in);

}  // namespace pipeline
