#include "levelset/molecules/molecule_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "levelset/error.h"
#include "tests/support/files.h"

namespace molecule_model_test {

using Imath::C3f;
using Imath::V3d;
using Imath::V3f;
using levelset::Molecule;
using levelset::MoleculeColour;
using levelset::MoleculeModel;
using levelset::moleculeModel;
using levelset::MoleculeStyle;
using support::refusal;

/// Carbon, oxygen and hydrogen in a row, in two residues of two chains, far from the origin.
Molecule threeAtoms() {
  Molecule molecule{.residues = {{"GLU", 1, "", 0}, {"XYZ", 2, "", 1}}, .chains = {"A", "B"}};
  const V3d at(1e6, -2e6, 3e6);
  molecule.atoms = {{.position = at, .element = 6, .bFactor = 10, .residue = 0},
                    {.position = at + V3d(1.25, 0, 0), .element = 8, .bFactor = 20, .residue = 0},
                    {.position = at + V3d(2.25, 0, 0), .element = 1, .bFactor = 30, .residue = 1}};
  return molecule;
}

TEST(MoleculeModel, HasABallForEachAtomAndTwoSticksForEachBond) {
  const MoleculeModel model = moleculeModel(threeAtoms());
  EXPECT_EQ(model.origin, V3d(1e6 + 1.125, -2e6, 3e6));
  ASSERT_EQ(model.balls.size(), 3u);
  ASSERT_EQ(model.sticks.size(), 4u);
  EXPECT_EQ(model.balls[0].centre, V3f(-1.125f, 0, 0));
  EXPECT_FLOAT_EQ(model.balls[0].radius, 1.7f / 4);
  EXPECT_EQ(model.sticks[0].from, model.balls[0].centre);
  EXPECT_EQ(model.sticks[0].to, V3f(-0.5f, 0, 0));
  EXPECT_EQ(model.sticks[1].from, model.sticks[0].to);
  EXPECT_EQ(model.sticks[1].to, model.balls[1].centre);
  EXPECT_EQ(model.sticks[3].colour, model.balls[2].colour);
  EXPECT_FLOAT_EQ(model.sticks[2].radius, 0.15f);
}

TEST(MoleculeModel, FollowsTheStyle) {
  const auto made = [](MoleculeStyle style) {
    return moleculeModel(threeAtoms(), {.style = style, .stickRadius = 0.35});
  };
  EXPECT_FLOAT_EQ(made(MoleculeStyle::VanDerWaals).balls[1].radius, 1.52f);
  EXPECT_TRUE(made(MoleculeStyle::VanDerWaals).sticks.empty());
  EXPECT_FLOAT_EQ(made(MoleculeStyle::Balls).balls[2].radius, 0.3f);
  EXPECT_TRUE(made(MoleculeStyle::Balls).sticks.empty());
  EXPECT_FLOAT_EQ(made(MoleculeStyle::Sticks).balls[0].radius, 0.35f);
  EXPECT_EQ(made(MoleculeStyle::Sticks).sticks.size(), 4u);
  // A ball is not thinner than its stick.
  EXPECT_FLOAT_EQ(made(MoleculeStyle::BallAndStick).balls[2].radius, 0.35f);
  EXPECT_FLOAT_EQ(made(MoleculeStyle::BallAndStick).balls[0].radius, 0.425f);
}

TEST(MoleculeModel, FollowsTheColours) {
  const auto colours = [](MoleculeColour colour) { return atomColours(threeAtoms(), colour); };
  const auto rgb = [](int r, int g, int b) {
    return C3f(static_cast<float>(r) / 255, static_cast<float>(g) / 255,
               static_cast<float>(b) / 255);
  };
  EXPECT_EQ(colours(MoleculeColour::Element),
            (std::vector<C3f>{rgb(144, 144, 144), rgb(255, 13, 13), rgb(255, 255, 255)}));
  EXPECT_EQ(colours(MoleculeColour::Chain),
            (std::vector<C3f>{rgb(0xe6, 0x9f, 0), rgb(0xe6, 0x9f, 0), rgb(0x56, 0xb4, 0xe9)}));
  EXPECT_EQ(colours(MoleculeColour::Residue),
            (std::vector<C3f>{rgb(0xe6, 10, 10), rgb(0xe6, 10, 10), rgb(0xbe, 0xa0, 0x6e)}));
  EXPECT_EQ(colours(MoleculeColour::BFactor),
            (std::vector<C3f>{C3f(0, 0, 1), C3f(1, 1, 1), C3f(1, 0, 0)}));
  EXPECT_EQ(atomColours(threeAtoms(), MoleculeColour::BFactor, std::array{20.0, 40.0})[2],
            C3f(1, 1, 1));
  Molecule equal = threeAtoms();
  for (levelset::Atom& atom : equal.atoms) atom.bFactor = 7;
  EXPECT_EQ(atomColours(equal, MoleculeColour::BFactor)[0], C3f(1, 1, 1));
}

TEST(MoleculeModel, KnowsAllElements) {
  EXPECT_EQ(levelset::covalentRadius(0), levelset::covalentRadius(6));
  EXPECT_DOUBLE_EQ(levelset::covalentRadius(1), 0.31);
  EXPECT_DOUBLE_EQ(levelset::covalentRadius(26), 1.32);
  EXPECT_DOUBLE_EQ(levelset::covalentRadius(96), 1.69);
  EXPECT_DOUBLE_EQ(levelset::covalentRadius(118), 1.69);
  EXPECT_EQ(levelset::elementColour(118), levelset::elementColour(109));
  EXPECT_EQ(levelset::elementColour(16), C3f(1, 1, 48.0f / 255));
}

TEST(MoleculeModel, Refuses) {
  using levelset::UsageError;
  EXPECT_SAYS(refusal<levelset::InvalidInput>([] { (void)moleculeModel({}); }), "no atoms");
  EXPECT_SAYS(refusal<UsageError>([] { (void)moleculeModel(threeAtoms(), {.ballScale = 1.5}); }),
              "scale");
  EXPECT_SAYS(refusal<UsageError>([] { (void)moleculeModel(threeAtoms(), {.stickRadius = 0}); }),
              "sticks");
  EXPECT_SAYS(refusal<UsageError>([] {
                (void)moleculeModel(threeAtoms(), {.bFactors = std::array{3.0, 3.0}});
              }),
              "temperature");
  EXPECT_FALSE(refusal<levelset::ResourceLimit>([] {
                 (void)moleculeModel(threeAtoms(), {.maxMemory = 100});
               }).empty());
}

}  // namespace molecule_model_test
