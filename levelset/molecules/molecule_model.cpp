#include "levelset/molecules/molecule_model.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string_view>

#include "levelset/error.h"
#include "levelset/memory/memory_limit.h"

namespace levelset {
namespace {

using Imath::C3f;
using Imath::V3d;
using Imath::V3f;

C3f colourOf(std::uint32_t bytes) {
  const auto part = [&](int shift) { return static_cast<float>(bytes >> shift & 0xff) / 255; };
  return {part(16), part(8), part(0)};
}

// [Wong11], without black.
constexpr std::array<std::uint32_t, 7> kChainColours = {0xe69f00, 0x56b4e9, 0x009e73, 0xf0e442,
                                                        0x0072b2, 0xd55e00, 0xcc79a7};

struct ResidueColour {
  std::string_view name;
  std::uint32_t colour;
};
// [Sayle95], the scheme "amino", and the scheme "shapely" for nucleic acids.
constexpr ResidueColour kResidueColours[] = {
    {"ALA", 0xc8c8c8}, {"ARG", 0x145aff}, {"ASN", 0x00dcdc}, {"ASP", 0xe60a0a}, {"CYS", 0xe6e600},
    {"GLN", 0x00dcdc}, {"GLU", 0xe60a0a}, {"GLY", 0xebebeb}, {"HIS", 0x8282d2}, {"ILE", 0x0f820f},
    {"LEU", 0x0f820f}, {"LYS", 0x145aff}, {"MET", 0xe6e600}, {"PHE", 0x3232aa}, {"PRO", 0xdc9682},
    {"SER", 0xfa9600}, {"THR", 0xfa9600}, {"TRP", 0xb45ab4}, {"TYR", 0x3232aa}, {"VAL", 0x0f820f},
    {"A", 0xa0a0ff},   {"DA", 0xa0a0ff},  {"C", 0xff8c4b},   {"DC", 0xff8c4b},  {"G", 0xff7070},
    {"DG", 0xff7070},  {"T", 0xa0ffa0},   {"DT", 0xa0ffa0},  {"U", 0xff8080},   {"DU", 0xff8080}};
constexpr std::uint32_t kOtherResidue = 0xbea06e;

C3f residueColour(std::string_view name) {
  const auto* found = std::find_if(std::begin(kResidueColours), std::end(kResidueColours),
                                   [&](const ResidueColour& c) { return c.name == name; });
  return colourOf(found == std::end(kResidueColours) ? kOtherResidue : found->colour);
}

/// Blue at 0, white at 1/2 and red at 1.
C3f blueWhiteRed(double at) {
  const auto t = static_cast<float>(std::clamp(at, 0.0, 1.0));
  return t < 0.5f ? C3f(2 * t, 2 * t, 1) : C3f(1, 2 - 2 * t, 2 - 2 * t);
}

}  // namespace

bool hasMoleculeSticks(MoleculeStyle style) {
  return style == MoleculeStyle::Sticks || style == MoleculeStyle::BallAndStick;
}

void checkMoleculeModel(const Molecule& molecule, const MoleculeModelOptions& options) {
  if (!(options.ballScale > 0) || !(options.ballScale <= 1))
    throw UsageError(
        fmt::format("the scale of balls is {}; give a number above 0 and at most 1, a share of the "
                    "van der Waals radius",
                    options.ballScale));
  if (!(options.stickRadius > 0) || !std::isfinite(options.stickRadius))
    throw UsageError(fmt::format("the radius of sticks is {}; give a positive, finite length",
                                 options.stickRadius));
  constexpr double kMostStickRadius = 3;
  if (options.stickRadius > kMostStickRadius)
    throw UsageError(fmt::format("the radius of sticks is {} Å; give at most {} Å",
                                 options.stickRadius, kMostStickRadius));
  if (options.bFactors &&
      !(std::isfinite((*options.bFactors)[0]) && std::isfinite((*options.bFactors)[1]) &&
        (*options.bFactors)[0] < (*options.bFactors)[1]))
    throw UsageError(fmt::format(
        "the range of temperature factors is {} to {}; give two finite numbers, the lesser first",
        (*options.bFactors)[0], (*options.bFactors)[1]));
  if (molecule.atoms.empty()) throw InvalidInput("the molecule has no atoms");
}

double moleculeBallRadius(const Atom& atom, const MoleculeModelOptions& options) {
  const double radius = vanDerWaalsRadius(atom.element);
  switch (options.style) {
    case MoleculeStyle::VanDerWaals:
      return radius;
    case MoleculeStyle::Sticks:
      return options.stickRadius;
    case MoleculeStyle::BallAndStick:
      return std::max(options.ballScale * radius, options.stickRadius);
    default:
      return options.ballScale * radius;
  }
}

std::size_t MoleculeModel::bytes() const {
  return sizeof(ModelBall) * balls.capacity() + sizeof(ModelStick) * sticks.capacity();
}

std::vector<C3f> atomColours(const Molecule& molecule, MoleculeColour colour,
                             const std::optional<std::array<double, 2>>& bFactors) {
  std::vector<C3f> colours, residues;
  colours.reserve(molecule.atoms.size());
  if (colour == MoleculeColour::Residue)
    for (const Residue& residue : molecule.residues)
      residues.push_back(residueColour(residue.name));
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const Atom& atom : molecule.atoms) {
    least = std::min<double>(least, atom.bFactor);
    most = std::max<double>(most, atom.bFactor);
  }
  if (bFactors) {
    least = (*bFactors)[0];
    most = (*bFactors)[1];
  }
  for (const Atom& atom : molecule.atoms) {
    const std::uint32_t chain = molecule.residues[atom.residue].chain;
    if (colour == MoleculeColour::Element)
      colours.push_back(elementColour(atom.element));
    else if (colour == MoleculeColour::Chain)
      colours.push_back(colourOf(kChainColours[chain % kChainColours.size()]));
    else if (colour == MoleculeColour::Residue)
      colours.push_back(residues[atom.residue]);
    else
      colours.push_back(blueWhiteRed(least < most ? (atom.bFactor - least) / (most - least) : 0.5));
  }
  return colours;
}

MoleculeModel moleculeModel(const Molecule& molecule, const MoleculeModelOptions& options) {
  checkMoleculeModel(molecule, options);
  const bool hasSticks = hasMoleculeSticks(options.style);
  const auto atoms = static_cast<double>(molecule.atoms.size());
  // Colours and balls; cells, radii and pairs of the search for bonds.
  requireMemory((sizeof(C3f) + sizeof(ModelBall) + (hasSticks ? 80 : 0)) * atoms,
                options.maxMemory);
  const std::vector<C3f> colours = atomColours(molecule, options.colour, options.bFactors);
  Imath::Box3d centres;
  for (const Atom& atom : molecule.atoms) centres.extendBy(atom.position);
  MoleculeModel model{.origin = centres.center()};
  const auto local = [&](const V3d& p) { return V3f(p - model.origin); };
  model.balls.reserve(molecule.atoms.size());
  for (std::size_t n = 0; n < molecule.atoms.size(); ++n) {
    const Atom& atom = molecule.atoms[n];
    model.balls.push_back(
        {local(atom.position), static_cast<float>(moleculeBallRadius(atom, options)), colours[n]});
  }
  if (!hasSticks) return model;
  const std::vector<Bond> bonds = moleculeBonds(molecule, options.bonds);
  requireMemory(static_cast<double>(model.bytes()) +
                    2.0 * sizeof(ModelStick) * static_cast<double>(bonds.size()),
                options.maxMemory);
  model.sticks.reserve(2 * bonds.size());
  const auto radius = static_cast<float>(options.stickRadius);
  for (const auto& [first, second] : bonds) {
    const V3d &a = molecule.atoms[first].position, &b = molecule.atoms[second].position;
    const V3f middle = local((a + b) / 2);
    model.sticks.push_back({local(a), middle, radius, colours[first]});
    model.sticks.push_back({middle, local(b), radius, colours[second]});
  }
  return model;
}

}  // namespace levelset
