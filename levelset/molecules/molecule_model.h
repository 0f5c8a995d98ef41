#pragma once

#include <Imath/ImathColor.h>
#include <Imath/ImathVec.h>

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "levelset/molecules/bonds.h"
#include "levelset/molecules/molecule.h"
#include "levelset/progress.h"

/// Molecules as balls and sticks, for pictures and prints.
namespace levelset {

enum class MoleculeStyle {
  Balls,         ///< a small ball for each atom
  Sticks,        ///< a stick for each bond, with round ends
  BallAndStick,  ///< both
  VanDerWaals    ///< a ball with the van der Waals radius for each atom
};

enum class MoleculeColour {
  Element,  ///< elementColour()
  Chain,    ///< seven colours that people with any colour vision can tell apart, in turn [Wong11]
  Residue,  ///< by the name of the residue, as RasMol's amino colours [Sayle95]
  BFactor   ///< blue, white and red, linear in the temperature factor
};

/// A ball of a model. Coordinates are relative to the model's origin.
struct ModelBall {
  Imath::V3f centre{0};
  float radius = 0;
  Imath::C3f colour{0};  ///< sRGB, from 0 to 1
};

/// A cylinder of a model. Its ends lie inside balls or other sticks.
struct ModelStick {
  Imath::V3f from{0}, to{0};  ///< ends of the axis, relative to the model's origin
  float radius = 0;
  Imath::C3f colour{0};
};

struct MoleculeModel {
  Imath::V3d origin{0};  ///< Å; coordinates in float are relative to it
  std::vector<ModelBall> balls = {};
  std::vector<ModelStick> sticks = {};

  [[nodiscard]] std::size_t bytes() const;
};

struct MoleculeModelOptions {
  MoleculeStyle style = MoleculeStyle::BallAndStick;
  MoleculeColour colour = MoleculeColour::Element;
  /// Radius of small balls as a share of the van der Waals radius, positive, at most 1. Balls at
  /// the ends of sticks have at least the radius of the sticks.
  double ballScale = 0.25;
  double stickRadius = 0.15;  ///< Å, positive, at most 3
  /// Temperature factors of blue and red, Å². Default: the least and the largest one.
  std::optional<std::array<double, 2>> bFactors = {};
  BondOptions bonds = {};
  std::size_t maxMemory = kNoMemoryLimit;
};

/// Makes the balls and sticks of a molecule: one ball for each atom, in its order, and two sticks
/// for each bond, of the colours of its ends. All balls of the style Sticks have the radius of the
/// sticks.
/// @throws UsageError for options out of range
/// @throws InvalidInput for a molecule without atoms; as moleculeBonds()
/// @throws ResourceLimit if the model exceeds `maxMemory`
[[nodiscard]] MoleculeModel moleculeModel(const Molecule& molecule,
                                          const MoleculeModelOptions& options = {});

/// Returns true for the styles that have sticks.
[[nodiscard]] bool hasMoleculeSticks(MoleculeStyle style);
/// Radius of the ball of an atom, Å.
[[nodiscard]] double moleculeBallRadius(const Atom& atom, const MoleculeModelOptions& options);
/// Checks the options and the molecule. Throws the same errors as moleculeModel().
void checkMoleculeModel(const Molecule& molecule, const MoleculeModelOptions& options);

/// Colours of the atoms, sRGB. @param bFactors  as in MoleculeModelOptions
[[nodiscard]] std::vector<Imath::C3f> atomColours(
    const Molecule& molecule, MoleculeColour colour,
    const std::optional<std::array<double, 2>>& bFactors = {});

}  // namespace levelset
