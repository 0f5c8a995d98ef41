#include <fmt/core.h>

#include <algorithm>
#include <numbers>
#include <string>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/operators/pictures/molecule_pictures.h"
#include "apps/pipeline/registry/invocation.h"
#include "levelset/error.h"
#include "levelset/molecules/solids/molecule_solid.h"

namespace pipeline {
namespace {

using levelset::MoleculeStyle;
using levelset::UsageError;

MoleculeStyle modelStyleOf(const Invocation& in) {
  return moleculeStyleNamed(in.text("style"));
}

/// Bounds of the solid, Å, or larger ones. Those of a molecule have its van der Waals balls, of 1.2
/// Å or more.
Imath::Box3d modelBoundsOf(Invocation& in) {
  Imath::Box3d bounds = in.operands[0].plan().bounds;
  const Imath::V3d beyond(std::max(0.0, in.length("stick-radius") - 1.2));
  if (!levelset::hasMoleculeSticks(modelStyleOf(in)) || bounds.isEmpty()) return bounds;
  return {bounds.min - beyond, bounds.max + beyond};
}

/// Area of the solid, Å²: carbon atoms, and a stick of 1.5 Å for each of them.
double modelAreaOf(Invocation& in, double atoms) {
  constexpr double kPi = std::numbers::pi;
  const MoleculeStyle style = modelStyleOf(in);
  // Spheres of atoms in a molecule are covered by others for the most part.
  if (style == MoleculeStyle::VanDerWaals) return 10 * atoms + 30;
  const double stick = levelset::hasMoleculeSticks(style) ? in.length("stick-radius") : 0;
  const double ball =
      style == MoleculeStyle::Sticks ? stick : std::max(stick, 1.7 * in.number("ball-scale"));
  return atoms * (4 * kPi * ball * ball + 2 * kPi * stick * 1.5) + 1;
}

double modelVoxelOf(Invocation& in) {
  const Imath::V3d size = modelBoundsOf(in).size();
  return in.voxelSize(std::max({size.x, size.y, size.z}));
}

Value runMoleculeModel(Invocation& in) {
  const levelset::Molecule& molecule = in.operands[0].molecule();
  const levelset::MoleculeSolidResult result = levelset::moleculeSolid(
      molecule, modelVoxelOf(in), moleculeModelOptions(in, "style"),
      {.halfWidth = in.number("half-width"), .maxMemory = in.maxMemory, .progress = in.progress});
  Json details{{"balls", result.balls}, {"bonds", result.bonds}};
  if (!levelset::hasMoleculeSticks(modelStyleOf(in))) details["volume"] = result.volume;
  in.notes.detailsJson = details.dump();
  in.notes.notes.push_back(
      fmt::format("molecule-model: {} balls and {} bonds", result.balls, result.bonds));
  return Value(result.band);
}

Plan planMoleculeModel(Invocation& in) {
  const double atoms = in.operands[0].plan().points;
  Plan plan{.kind = Kind::Band};
  plan.bounds = modelBoundsOf(in);
  plan.voxelSize = modelVoxelOf(in);
  plan.halfWidth = in.number("half-width");
  plan.area = modelAreaOf(in, atoms);
  return plan;
}

std::optional<Cost> costOfMoleculeModel(Invocation& in) {
  const double atoms = in.operands[0].plan().points;
  if (!(atoms > 0) || !in.planned) return std::nullopt;
  const double samples = 14 * in.planned->estimate().layer();
  return Cost{2e-4 * atoms + 2e-6 * samples, 20'000 * atoms + 20 * samples};
}

void validateMoleculeSolid(const Invocation& in) {
  requireVoxelSize(in);
  validateMoleculeModel(in, "style");
}

}  // namespace

Operator moleculeModelOperator() {
  Operator op = {
      .name = "molecule-model",
      .group = "Molecules",
      .summary = "turn a molecule into a solid of balls and sticks",
      .details =
          "--style balls has a small ball for each atom, sticks a stick for each bond, "
          "ball-and-stick both, and van-der-waals a ball of the van der Waals radius for each "
          "atom. "
          "Bonds are those that the file gives and those by distance: two atoms are bonded if they "
          "are at most 0.45 Å farther apart than the sum of their covalent radii. Lengths are in "
          "ångström. The distances are exact on both sides. Scale the result for a print.",
      .example =
          "levelsmith read protein.pdb ! molecule-model --voxel 0.05 ! mesh ! write model.stl",
      .params = {{.name = "style",
                  .type = ParamType::Choice,
                  .doc = "parts of the solid",
                  .fallback = "ball-and-stick",
                  .choices = moleculeStyleNames()},
                 voxelParam(),
                 resolutionParam(),
                 halfWidthParam()},
      .operands = {{Kind::Molecule}},
      .resultKind = [](const Invocation&) { return Kind::Band; },
      .run = runMoleculeModel,
      .plan = planMoleculeModel,
      .cost = costOfMoleculeModel,
      .validate = validateMoleculeSolid,
  };
  const std::vector<Param> sizes = moleculeModelParams();
  op.params.insert(std::next(op.params.begin()), sizes.begin(), sizes.end());
  return op;
}

}  // namespace pipeline
