#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "apps/pipeline/operators/common.h"
#include "apps/pipeline/operators/declarations.h"
#include "apps/pipeline/operators/json_output.h"
#include "apps/pipeline/registry/invocation.h"
#include "apps/pipeline/values/text_file.h"
#include "levelset/components/components.h"
#include "levelset/error.h"
#include "levelset/molecules/molecule_surface.h"

namespace pipeline {
namespace {

using levelset::Molecule;
using levelset::MoleculeSurface;
using levelset::UsageError;

MoleculeSurface surfaceKindOf(const Invocation& in) {
  const std::string word = in.text("kind");
  if (word == "vdw") return MoleculeSurface::VanDerWaals;
  return word == "accessible" ? MoleculeSurface::Accessible : MoleculeSurface::Excluded;
}

/// Returns a text as a field of a CSV file.
std::string areaField(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    quoted += c;
    if (c == '"') quoted += c;
  }
  return quoted + '"';
}

std::string residueFields(const Molecule& molecule, std::size_t residue) {
  const levelset::Residue& of = molecule.residues[residue];
  return fmt::format("{},{},{}{}", areaField(molecule.chains[of.chain]), areaField(of.name),
                     of.number, areaField(of.insertion));
}

/// Table of a quantity for each atom. @param name  its name, the heading of the last column
std::string atomTable(const Molecule& molecule, const std::vector<double>& areas,
                      const char* name) {
  std::string text = fmt::format("chain,residue,number,atom,element,x,y,z,{}\n", name);
  for (std::size_t n = 0; n < areas.size(); ++n) {
    const levelset::Atom& atom = molecule.atoms[n];
    text += fmt::format("{},{},{},{},{},{},{:.6g}\n", residueFields(molecule, atom.residue),
                        areaField(atom.name), levelset::elementSymbol(atom.element),
                        atom.position.x, atom.position.y, atom.position.z, areas[n]);
  }
  return text;
}

std::string residueTable(const Molecule& molecule, const std::vector<double>& areas,
                         const char* name) {
  std::string text = fmt::format("chain,residue,number,{}\n", name);
  const std::vector<double> sums = residueAreas(molecule, areas);
  for (std::size_t n = 0; n < sums.size(); ++n)
    text += fmt::format("{},{:.6g}\n", residueFields(molecule, n), sums[n]);
  return text;
}

/// Table of the cavities, with the atoms that bound them.
std::string cavityTable(const Molecule& molecule,
                        const std::vector<levelset::MoleculeCavity>& cavities) {
  std::string text = "cavity,volume,area,atoms\n";
  for (std::size_t n = 0; n < cavities.size(); ++n) {
    std::string atoms;
    for (const std::uint32_t index : cavities[n].atoms) {
      const levelset::Atom& atom = molecule.atoms[index];
      atoms += fmt::format("{}{} {}", atoms.empty() ? "" : "; ", molecule.residueName(atom.residue),
                           atom.name);
    }
    text += fmt::format("{},{:.6g},{:.6g},{}\n", n + 1, cavities[n].volume, cavities[n].area,
                        areaField(atoms));
  }
  return text;
}

Json cavityList(const std::vector<levelset::MoleculeCavity>& cavities) {
  Json list = Json::array();
  for (const levelset::MoleculeCavity& cavity : cavities)
    list.push_back(
        {{"volume", cavity.volume}, {"area", cavity.area}, {"atoms", cavity.atoms.size()}});
  return list;
}

/// Writes the tables that the options ask for.
void writeTables(Invocation& in, const Molecule& molecule,
                 const levelset::MoleculeSurfaceResult& result) {
  const auto write = [&](const char* option, const auto& text) {
    if (in.given(option))
      writeText(in.text(option), text(), fmt::format("molecule-surface: --{}", option));
  };
  write("areas", [&] { return atomTable(molecule, result.areas, "area"); });
  write("residue-areas", [&] { return residueTable(molecule, result.areas, "area"); });
  write("volumes", [&] { return atomTable(molecule, result.volumes, "volume"); });
  write("residue-volumes", [&] { return residueTable(molecule, result.volumes, "volume"); });
  write("cavities", [&] { return cavityTable(molecule, result.cavities); });
}

/// Bounds of the solid, Å.
Imath::Box3d boundsOf(Invocation& in) {
  return grown(in.operands[0].plan().bounds,
               surfaceKindOf(in) == MoleculeSurface::Accessible ? in.length("probe") : 0);
}

double voxelSizeOf(Invocation& in) {
  const Imath::V3d size = boundsOf(in).size();
  return in.voxelSize(std::max({size.x, size.y, size.z}));
}

Value runMoleculeSurface(Invocation& in) {
  const Molecule& molecule = in.operands[0].molecule();
  const double voxelSize = voxelSizeOf(in);
  const MoleculeSurface kind = surfaceKindOf(in);
  const levelset::MoleculeSurfaceResult result =
      levelset::moleculeSurface(molecule, voxelSize,
                                {.kind = kind,
                                 .probe = in.length("probe"),
                                 .halfWidth = in.number("half-width"),
                                 .volumes = in.given("volumes") || in.given("residue-volumes"),
                                 .cavities = in.given("cavities"),
                                 .maxMemory = in.maxMemory,
                                 .progress = in.progress});
  double area = 0;
  std::size_t exposed = 0;
  for (const double part : result.areas) {
    area += part;
    exposed += part > 0;
  }
  const levelset::Topology found = levelset::topology(result.band);
  const bool isOfAtoms = kind == MoleculeSurface::VanDerWaals;
  Json details{{"atoms", molecule.atoms.size()},
               {"exposed_atoms", exposed},
               {isOfAtoms ? "vdw_area" : "accessible_area", area},
               {isOfAtoms ? "vdw_volume" : "accessible_volume", result.volume},
               {"components", found.components},
               {"cavities", found.cavities}};
  if (in.given("cavities")) details["cavity_list"] = cavityList(result.cavities);
  in.notes.detailsJson = details.dump();
  in.notes.notes.push_back(fmt::format(
      "molecule-surface: {} of {} atoms reach the {} surface, whose exact area is {:.6g} Å² and "
      "volume {:.6g} Å³; {} cavities",
      exposed, molecule.atoms.size(), isOfAtoms ? "van der Waals" : "accessible", area,
      result.volume, found.cavities));
  if (result.unfinished > 0)
    in.notes.warnings.push_back(
        fmt::format("molecule-surface: {} distances outside, beside edges where many probes meet, "
                    "are lower bounds",
                    result.unfinished));
  writeTables(in, molecule, result);
  return Value(result.band);
}

Plan planMoleculeSurface(Invocation& in) {
  const double atoms = in.operands[0].plan().points;
  Plan plan{.kind = Kind::Band};
  plan.bounds = boundsOf(in);
  plan.voxelSize = voxelSizeOf(in);
  plan.halfWidth = in.number("half-width");
  // Å². A protein of 4,334 atoms with hydrogen has 7.6 for each atom on the van der Waals surface,
  // and 3.5 on the others. One atom has 120 on the accessible surface.
  plan.area = surfaceKindOf(in) == MoleculeSurface::VanDerWaals ? 10 * atoms + 30
                                                                : 120 * std::pow(atoms, 2.0 / 3);
  return plan;
}

std::optional<Cost> costOfMoleculeSurface(Invocation& in) {
  const double atoms = in.operands[0].plan().points;
  if (!(atoms > 0) || !in.planned) return std::nullopt;
  const double samples = 14 * in.planned->estimate().layer();
  return Cost{4e-5 * atoms + 4e-7 * samples, 6000 * atoms + 20 * samples};
}

void validateMoleculeSurface(const Invocation& in) {
  requireVoxelSize(in);
  if (in.given("probe") && surfaceKindOf(in) == MoleculeSurface::VanDerWaals)
    throw UsageError("molecule-surface: --probe does not apply to --kind vdw; leave it out");
}

std::vector<std::string> areaFilesOf(const Invocation& in) {
  std::vector<std::string> targets;
  for (const char* name : {"areas", "residue-areas", "volumes", "residue-volumes", "cavities"})
    if (in.given(name)) targets.push_back(in.text(name));
  return targets;
}

}  // namespace

Operator moleculeSurfaceOperator() {
  return {
      .name = "molecule-surface",
      .group = "Molecules",
      .summary = "turn a molecule into a solid with exact distances",
      .details =
          "--kind vdw is the union of the balls of the atoms with van der Waals radii. accessible "
          "has radii that are larger by that of the probe. excluded is all that the ball of the "
          "probe cannot reach, also inside. Lengths are in ångström. The distances are exact on "
          "both "
          "sides, also beside the edges where probes at several places meet. The report has the "
          "exact area and volume of the van der Waals surface, or of the accessible one, and the "
          "number of cavities. Molecules without hydrogen atoms keep the radii of their elements.",
      .example =
          "levelsmith read protein.pdb ! molecule-surface --voxel 0.3 ! mesh ! write protein.ply",
      .params = {{.name = "kind",
                  .type = ParamType::Choice,
                  .doc = "surface: of the balls of the atoms, of those grown by the probe, or of "
                         "the space that the probe cannot reach",
                  .fallback = "excluded",
                  .choices = {"vdw", "accessible", "excluded"}},
                 {.name = "probe",
                  .type = ParamType::Length,
                  .doc = "radius of the probe; that of water is 1.4",
                  .fallback = "1.4",
                  .range = Range::Positive,
                  .allowsVoxels = false},
                 voxelParam(),
                 resolutionParam(),
                 halfWidthParam(),
                 {.name = "areas",
                  .type = ParamType::Path,
                  .doc =
                      "write the exact area of the sphere of each atom outside the others to this "
                      "CSV file"},
                 {.name = "residue-areas",
                  .type = ParamType::Path,
                  .doc = "write the sums of these areas over residues to this CSV file"},
                 {.name = "volumes",
                  .type = ParamType::Path,
                  .doc =
                      "write the exact volume of the ball of each atom, within its cell of the "
                      "power diagram, to this CSV file; they add up to the volume of the report"},
                 {.name = "residue-volumes",
                  .type = ParamType::Path,
                  .doc = "write the sums of these volumes over residues to this CSV file"},
                 {.name = "cavities",
                  .type = ParamType::Path,
                  .doc = "write volume, area and atoms of each cavity to this CSV file; exact for "
                         "vdw and accessible, those of the mesh for excluded"}},
      .operands = {{Kind::Molecule}},
      .resultKind = [](const Invocation&) { return Kind::Band; },
      .run = runMoleculeSurface,
      .plan = planMoleculeSurface,
      .cost = costOfMoleculeSurface,
      .validate = validateMoleculeSurface,
      .targets = areaFilesOf,
  };
}

}  // namespace pipeline
